#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/step_graph.hpp"
#include "torsio/export/warp_kernel.hpp"
#include "torsio/files/model_file.hpp"

void export_warp(ExportFlags& flags) {
  require_ending("-o", flags.output, {".py"});
  const torsio::WarpKernelOptions options{
      .name = std::filesystem::path(flags.output).stem().string(),
      .precision = precision_of(flags, torsio::GraphPrecision::mixed)};
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
  nlohmann::json document = export_document(model);
  document["file"] = flags.output;
  document["real"] = real;
  document["sample_rate_Hz"] = model.settings.sample_rate_Hz;
  document["bytes"] = text.size();
  flags.json.write(document.dump(2) + "\n");
}
