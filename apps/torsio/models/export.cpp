#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "verbs.hpp"

void require_new(const ExportFlags& flags, const std::string& file) {
  require_writable(file);
  if (!flags.overwrite && std::filesystem::exists(file))
    throw torsio::UsageError(
        {.place = file,
         .problem = "the file exists",
         .advice = "Take another name or folder, or replace it with --overwrite."});
}

torsio::CReal real_of(const ExportFlags& flags, torsio::CReal otherwise) {
  if (flags.real.empty()) return otherwise;
  if (flags.real == "float") return torsio::CReal::single;
  if (flags.real == "double") return torsio::CReal::twofold;
  throw torsio::UsageError({.place = "--real", .expected = "float or double", .found = flags.real});
}

torsio::GraphPrecision precision_of(const ExportFlags& flags, torsio::GraphPrecision otherwise) {
  if (flags.real.empty()) return otherwise;
  if (flags.real == "float") return torsio::GraphPrecision::single;
  if (flags.real == "mixed") return torsio::GraphPrecision::mixed;
  if (flags.real == "double") return torsio::GraphPrecision::twofold;
  throw torsio::UsageError(
      {.place = "--real", .expected = "float, mixed or double", .found = flags.real});
}

nlohmann::json export_document(const torsio::ModelFile& model) {
  return {{"format", "torsio.export"},
          {"version", 1},
          {"family", std::string(model.parameters.family())}};
}

namespace {

/// The flag that selects a target, and those that belong to it.
struct Target {
  const char* flag;
  void (*write)(ExportFlags&);
  std::vector<const char*> own;
};

const std::vector<Target>& export_targets() {
  static const std::vector<Target> targets{
      {"--c99",
       export_c99,
       {"--real", "--counts", "--controller", "--target", "--flash", "--ram", "--clock"}},
      {"--onnx", export_onnx, {"--real", "--layout"}},
      {"--torchscript", export_torchscript, {"--real", "--layout"}},
      {"--mjcf", export_mjcf, {"--actuator", "--linear-spring"}},
      {"--fmi", export_fmu, {"--real", "--compile"}},
      {"--warp", export_warp, {"--real"}}};
  return targets;
}

/// The flags of targets that take it.
std::string takers_of(const std::string& option) {
  std::vector<std::string_view> takers;
  for (const Target& target : export_targets())
    if (std::ranges::find(target.own, option, [](const char* each) { return std::string(each); }) !=
        target.own.end())
      takers.emplace_back(target.flag);
  return fmt::format("{}", fmt::join(takers, ", "));
}

const Target& wanted_target(const CLI::App& verb) {
  const Target* wanted = nullptr;
  std::vector<std::string_view> all;
  for (const Target& target : export_targets()) {
    all.emplace_back(target.flag);
    if (verb.count(target.flag) == 0) continue;
    if (wanted != nullptr)
      throw torsio::UsageError({.place = target.flag,
                                .problem = "one target at a time",
                                .advice = std::string("Remove it or ") + wanted->flag + "."});
    wanted = &target;
  }
  if (wanted == nullptr)
    throw torsio::UsageError({.place = "torsio export",
                              .expected = fmt::format("a target: {}", fmt::join(all, ", ")),
                              .advice = "torsio export --help describes them."});
  return *wanted;
}

void run_export(const CLI::App& verb, ExportFlags& flags) {
  const Target& wanted = wanted_target(verb);
  for (const Target& target : export_targets())
    for (const char* const option : target.own) {
      const auto is_same = [&](const char* own) { return std::string_view(own) == option; };
      if (verb.count(option) == 0 || std::ranges::any_of(wanted.own, is_same)) continue;
      throw torsio::UsageError({.place = option,
                                .problem = "it belongs to " + takers_of(option),
                                .advice = std::string("Remove it, or ") + wanted.flag + "."});
    }
  wanted.write(flags);
}

}  // namespace

void add_export(CLI::App& app) {
  auto flags = std::make_shared<ExportFlags>();
  CLI::App* verb = app.add_subcommand(
      "export",
      "write a model for a drive, a simulator or a trainer: C99, ONNX, MuJoCo, FMI, Warp");
  verb->footer(
      "Example: torsio export joint.safetensors --c99 joint --counts gear_angle_rad=524288 "
      "--counts joint_angle_rad=524288 -o firmware\n"
      "         torsio export joint.safetensors --onnx -o joint.onnx\n"
      "--c99 writes firmware/joint.h and firmware/joint.c: C99 without a library or a heap. "
      "Compiled with -DJOINT_SELF_TEST (the name in capitals) joint.c has joint_self_test(), to be "
      "called once on each new target: it returns the largest difference from torsio's own "
      "values, which joint.c contains, as a share of the torque's range: at most 1e-4 in float and "
      "1e-6 in double, 1000 if a fault differs. A float does not resolve the "
      "difference of two angles: give angles as counts of their encoders.\n"
      "docs/robot/embedded.md and docs/robot/simulators.md state what each target contains and "
      "what is lost.");
  verb->add_option("MODEL", flags->model, "model file written by torsio fit")->required();
  verb->add_option("--c99", flags->c99,
                   "a C program of this name: that of its files and the prefix of its functions");
  verb->add_option(
      "--real", flags->real,
      "type of its numbers: float, double or, for --onnx and --warp, mixed, which has 64 bits for "
      "inputs and features only (default: --c99 float, --warp mixed, others double)");
  verb->add_option(
      "--counts", flags->counts,
      "CHANNEL=COUNTS: this angle is given as counts of an encoder, with so many in a turn "
      "of the joint: those of an encoder before the gear times its ratio; negative if "
      "the angle falls where they rise; auto: those of the model's mapping");
  verb->add_option(
      "--controller", flags->controller,
      "FILE.yaml of torsio tune-loop: add the controller of the joint, with the model as "
      "the inverse of its spring");
  verb->add_flag("--onnx", flags->onnx,
                 "the estimator as an ONNX graph, its state as input and output; -o FILE.onnx");
  verb->add_option(
      "--layout", flags->layout,
      "of --onnx: estimator (the default), network (an mlp, gru or lstm from its features, as "
      "torsio import reads it) or newton (as Newton loads its neural drives)");
  verb->add_flag("--torchscript", flags->torchscript,
                 "names the command of the Python module that writes TorchScript");
  verb->add_flag("--mjcf", flags->mjcf,
                 "a joint with this spring as a model of MuJoCo; -o FILE.xml, whose name without "
                 "its ending is the prefix of all names in it");
  verb->add_option("--actuator", flags->actuator,
                   "inertias, gear, motor and friction of --mjcf: an actuator of torsio simulate "
                   "--list, or a file of a data sheet (default dfki-50)");
  verb->add_flag("--linear-spring", flags->linear_spring,
                 "--mjcf with the linear fallback as the spring, which MuJoCo computes without "
                 "torsio");
  verb->add_option("--fmi", flags->fmi,
                   "an FMU for co-simulation of FMI 2 or 3, with the C program as its sources; -o "
                   "NAME.fmu, NAME being its model identifier");
  verb->add_flag("--compile", flags->compile,
                 "--fmi with a library, which most importers need, for the machine of the C "
                 "compiler $CC (default cc)");
  verb->add_flag("--warp", flags->warp,
                 "the estimator as a kernel of NVIDIA Warp for MuJoCo-Warp and Newton; -o NAME.py, "
                 "NAME being that of its Python module");
  verb->add_option("-o,--output", flags->output,
                   "folder of the files of a C program, or file of another target")
      ->required();
  verb->add_option(
      "--target", flags->target,
      "estimate the cost for this target only: cortex-m4f or cortex-m7 (--real double: cortex-m7)");
  verb->add_option("--flash", flags->flash,
                   "memory of the target for the program: 256kB; refused if it does not fit");
  verb->add_option("--ram", flags->ram,
                   "memory of the target for the state of a joint and the stack: 16kB");
  verb->add_option(
      "--clock", flags->clock,
      "clock of the target: 168MHz; refused if a step takes more than half of a period");
  verb->add_flag("--overwrite", flags->overwrite, "replace files that exist");
  flags->json.add(*verb, "names and costs");
  verb->callback([verb, flags] { run_export(*verb, *flags); });
}
