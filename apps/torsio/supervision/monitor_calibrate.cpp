#include "supervision/monitor_calibrate.hpp"

#include <algorithm>
#include <utility>

#include "common/output.hpp"
#include "common/progress_bar.hpp"
#include "core/quantity.hpp"
#include "evaluate/monitor/monitor_from_models.hpp"
#include "report/monitor.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"

namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// NAME=MODEL, NAME=MODEL,FRICTION, each with or without :PART+PART
torsio::SourceFiles source_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
    throw torsio::UsageError(
        {.place = "--source",
         .expected = "NAME=MODEL, NAME=MODEL:PART+PART or NAME=MODEL,FRICTION:PART+PART",
         .found = "'" + text + "'",
         .advice = "for example --source spring=spring.safetensors:gear_encoder+joint_encoder"});
  torsio::SourceFiles flag{.source = {.name = text.substr(0, equals), .depends_on = {}},
                           .model = text.substr(equals + 1),
                           .friction = {}};
  if (const std::size_t colon = flag.model.rfind(':'); colon != std::string::npos) {
    flag.source.depends_on = split(flag.model.substr(colon + 1), '+');
    flag.model.resize(colon);
  }
  if (const std::size_t comma = flag.model.find(','); comma != std::string::npos) {
    flag.friction = flag.model.substr(comma + 1);
    flag.model.resize(comma);
  }
  return flag;
}

/// With its unit, or the value of an option that is not given.
double quantity_or(const std::string& text, const char* unit, const char* option, double value) {
  return text.empty() ? value : torsio::signed_quantity_with_unit(text, unit, option);
}

}  // namespace

void use_common_mapping(DataFlags& data, const std::vector<torsio::ModelMapping>& models) {
  const torsio::ModelMapping& used =
      data.mapping.empty() ? torsio::common_mapping(models) : models.front();
  data.use_model_mapping(used.mapping, used.file);
}

void calibrate(CalibrateFlags& flags, DataFlags& data, const JsonOutput& json) {
  if (flags.sources.size() < 2)
    throw torsio::UsageError(
        {.place = "--calibrate",
         .expected = "at least two --source NAME=MODEL, which the monitor compares",
         .found = flags.sources.empty() ? "none" : "one"});
  torsio::check_last_day(flags.valid_until, "--valid-until");
  torsio::MonitorRequest request{.sources = {},
                                 .signals = flags.signals,
                                 .output = flags.output,
                                 .device_serial = flags.device_serial,
                                 .valid_until = flags.valid_until};
  std::vector<std::string> models;
  for (const std::string& text : flags.sources) {
    request.sources.push_back(source_of(text));
    models.push_back(request.sources.back().model);
    if (!request.sources.back().friction.empty()) models.push_back(request.sources.back().friction);
  }
  torsio::CalibrationOptions& options = request.options;
  options.false_alarms_per_hour = flags.false_alarms_per_hour;
  options.extrapolate = flags.extrapolate;
  options.least_threshold_Nm = quantity_or(flags.least_threshold, "Nm", "--least-threshold", 0.0);
  options.persistence_s =
      quantity_or(flags.persistence, "s", "--persistence", options.persistence_s);
  options.required_Nm = quantity_or(flags.required, "Nm", "--required", options.required_Nm);
  torsio::MonitorFromModels monitor(std::move(request));
  use_common_mapping(data, monitor.mappings());
  data.check_outputs({flags.output, json.destination}, models);
  require_writable(flags.output);
  ProgressBar progress;
  const torsio::Dataset dataset = data.load_inputs(monitor.channels(), progress.listener());
  const torsio::CalibratedMonitor calibrated = monitor.calibrate(dataset, progress.listener());
  if (json.wants_tables()) print(torsio::calibration_text(calibrated));
  json.write(torsio::calibration_json(calibrated));
}
