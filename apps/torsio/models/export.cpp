#include <array>
#include <filesystem>
#include <memory>
#include <string>
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

namespace {

/// A target and the flag that selects it.
struct Target {
  const char* flag;
  bool is_wanted;
  void (*write)(ExportFlags&);
};

void run(ExportFlags& flags) {
  const std::array targets{Target{"--c99", !flags.c99.empty(), export_c99},
                           Target{"--onnx", flags.onnx, export_onnx},
                           Target{"--torchscript", flags.torchscript, export_torchscript},
                           Target{"--mjcf", flags.mjcf, export_mjcf},
                           Target{"--fmi", !flags.fmi.empty(), export_fmu},
                           Target{"--warp", flags.warp, export_warp}};
  const Target* wanted = nullptr;
  for (const Target& target : targets) {
    if (!target.is_wanted) continue;
    if (wanted != nullptr)
      throw torsio::UsageError({.place = target.flag,
                                .problem = "one target at a time",
                                .advice = std::string("Remove it or ") + wanted->flag + "."});
    wanted = &target;
  }
  if (wanted == nullptr)
    throw torsio::UsageError(
        {.place = "torsio export",
         .expected = "a target: --c99 NAME, --onnx, --torchscript, --mjcf, --fmi or --warp",
         .advice = "torsio export --help describes them."});
  if (!flags.mjcf && (!flags.actuator.empty() || flags.linear_spring))
    throw torsio::UsageError({.place = flags.linear_spring ? "--linear-spring" : "--actuator",
                              .problem = "it belongs to --mjcf",
                              .advice = std::string("Remove it, or ") + wanted->flag + "."});
  if (flags.compile && flags.fmi.empty())
    throw torsio::UsageError({.place = "--compile",
                              .problem = "it belongs to --fmi",
                              .advice = std::string("Remove it, or ") + wanted->flag + "."});
  wanted->write(flags);
}

}  // namespace

void add_export(CLI::App& app) {
  auto flags = std::make_shared<ExportFlags>();
  CLI::App* verb =
      app.add_subcommand("export", "write a model as a C program for a drive's microcontroller");
  verb->footer(
      "Example: torsio export joint.safetensors --c99 joint --real float --counts "
      "gear_angle_rad=524288 --counts joint_angle_rad=524288 -o firmware\n"
      "Writes firmware/joint.h and firmware/joint.c: C99 without a library or a heap, with the "
      "pipeline, the guards, the fallback, the error bar and the faults of the estimator. Compiled "
      "with -DJOINT_SELF_TEST it compares itself with torsio.\n"
      "A float does not resolve the difference of two angles: give angles as counts of their "
      "encoders.");
  verb->add_option("MODEL", flags->model, "model file written by torsio fit")->required();
  verb->add_option("--c99", flags->c99,
                   "a C program of this name: that of its files and the prefix of its functions");
  verb->add_option("--real", flags->real,
                   "type of its numbers: float or double (default float for --c99)");
  verb->add_option("--counts", flags->counts,
                   "CHANNEL=COUNTS: this angle is given as counts of an encoder with so many in a "
                   "turn; negative if the angle falls where they rise");
  verb->add_option(
      "--controller", flags->controller,
      "FILE.yaml of torsio tune-loop: add the controller of the joint, with the model as "
      "the inverse of its spring");
  verb->add_flag("--onnx", flags->onnx,
                 "the estimator as an ONNX graph, its state as input and output; -o FILE.onnx "
                 "(--real float, mixed or double, default double)");
  verb->add_option("--layout", flags->layout,
                   "of --onnx: estimator (the default), network (an mlp, gru or lstm from its "
                   "features, as torsio "
                   "import reads it) or newton (the same as Newton loads its neural drives)");
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
                   "NAME.fmu, NAME being its model identifier (--real float or double, default "
                   "double)");
  verb->add_flag("--compile", flags->compile,
                 "--fmi with a library, which most importers need, for the machine of the C "
                 "compiler $CC (default cc)");
  verb->add_flag("--warp", flags->warp,
                 "the estimator as a kernel of NVIDIA Warp for MuJoCo-Warp and Newton; -o NAME.py, "
                 "NAME being that of its Python module (--real float, mixed or double, default "
                 "mixed)");
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
  verb->add_option("--json", flags->json.destination,
                   "write names and costs as JSON to a file, or - for standard output");
  verb->callback([flags] { run(*flags); });
}
