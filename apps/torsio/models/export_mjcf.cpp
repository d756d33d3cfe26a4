#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "models/export_flags.hpp"
#include "torsio/core/error.hpp"
#include "torsio/export/mjcf.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/sim/bench/sheet_file.hpp"

void export_mjcf(ExportFlags& flags) {
  require_ending("-o", flags.output, {".xml"});
  const std::filesystem::path file(flags.output);
  const torsio::MjcfOptions options{
      .name = file.stem().string(),
      .actuator = torsio::find_data_sheet(flags.actuator.empty() ? "dfki-50" : flags.actuator),
      .is_linear = flags.linear_spring};
  const torsio::ModelFile model = torsio::load_model(flags.model);
  const std::string text =
      torsio::mjcf_text(model, options, std::filesystem::path(flags.model).filename().string());
  require_new(flags, flags.output);
  write_text(flags.output, text);
  if (flags.json.wants_tables())
    print(fmt::format("{} written: {}, {:g} Hz, {}, spring: {}\n", flags.output,
                      model.parameters.family(), model.settings.sample_rate_Hz,
                      torsio::full_name(options.actuator),
                      options.is_linear ? "linear fallback" : "the model, by torsio::mujoco"));
  nlohmann::json document = export_document(model);
  document["mjcf"] = flags.output;
  document["actuator"] = torsio::full_name(options.actuator);
  document["spring"] = options.is_linear ? "linear" : "model";
  flags.json.write(document.dump(2) + "\n");
}
