#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/step_graph.hpp"
#include "torsio/export/warp_kernel.hpp"
#include "torsio/files/model_file.hpp"

namespace {

void refuse_flags_of_others(const ExportFlags& flags) {
  if (flags.counts.empty() && flags.controller.empty() && flags.target.empty() &&
      flags.flash.empty() && flags.ram.empty() && flags.clock.empty() && flags.layout.empty())
    return;
  throw torsio::UsageError(
      {.place = "--warp",
       .problem = "--counts, --controller, --target, --flash, --ram, --clock and --layout are not "
                  "those of a kernel",
       .advice = "Remove them."});
}

torsio::GraphPrecision precision_of_kernel(const std::string& text) {
  if (text.empty() || text == "mixed") return torsio::GraphPrecision::mixed;
  if (text == "float") return torsio::GraphPrecision::single;
  if (text == "double") return torsio::GraphPrecision::twofold;
  throw torsio::UsageError(
      {.place = "--real", .expected = "float, mixed or double", .found = text});
}

}  // namespace

void export_warp(ExportFlags& flags) {
  refuse_flags_of_others(flags);
  require_ending("-o", flags.output, {".py"});
  const torsio::WarpKernelOptions options{
      .name = std::filesystem::path(flags.output).stem().string(),
      .precision = precision_of_kernel(flags.real)};
  const torsio::ModelFile model = torsio::load_model(flags.model);
  const std::string text = torsio::warp_kernel_text(
      model, options, std::filesystem::path(flags.model).filename().string());
  require_new(flags, flags.output);
  write_text(flags.output, text);
  const std::string real = flags.real.empty() ? "mixed" : flags.real;
  if (flags.json.wants_tables())
    print(fmt::format("{} written: {}, {}, one tick at {:g} Hz; not tested with Warp\n",
                      flags.output, model.parameters.family(), real,
                      model.settings.sample_rate_Hz));
  const nlohmann::json document{{"format", "torsio.export"},
                                {"version", 1},
                                {"family", std::string(model.parameters.family())},
                                {"file", flags.output},
                                {"real", real},
                                {"sample_rate_Hz", model.settings.sample_rate_Hz},
                                {"bytes", text.size()}};
  flags.json.write(document.dump(2) + "\n");
}
