#include "torsio/files/monitor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>

#include "core/fnv_hash.hpp"
#include "files/json_object.hpp"
#include "files/json_text.hpp"
#include "files/whole_file.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/version.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRateTolerance = 1e-3;
constexpr std::string_view kMonitorAdvice =
    "The monitor file is damaged: calibrate the monitor again (torsio monitor --calibrate).";

double limit_of(const JsonObject& object, const char* key, double none) {
  const double value = object.number(key);
  return std::isnan(value) ? none : value;
}
/// The default where there is none: a file of an earlier release.
void read_optional(const JsonObject& object, const char* key, double& value) {
  if (object.has(key)) value = limit_of(object, key, kInfinity);
}

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

ordered_json signal_json(const MonitoredSignal& signal) {
  return {{"signal", signal.name},
          {"lowest", json_number(signal.lowest)},
          {"highest", json_number(signal.highest)},
          {"largest_rate", json_number(signal.largest_rate)},
          {"longest_age_s", json_number(signal.longest_age_s)},
          {"turn", signal.turn},
          {"moves_with", signal.moves_with},
          {"largest_hidden_travel", json_number(signal.largest_hidden_travel)}};
}

MonitoredSignal signal_of(const JsonObject& object, const std::string& place) {
  object.allow_only({"signal", "lowest", "highest", "largest_rate", "longest_age_s", "turn",
                     "moves_with", "largest_hidden_travel"});
  const std::string moves_with = object.text("moves_with");
  const double largest_hidden_travel = limit_of(object, "largest_hidden_travel", kInfinity);
  if (!moves_with.empty() && std::isinf(largest_hidden_travel))
    throw Error(
        {.place = fmt::format("{}/{}: largest_hidden_travel", place, object.text("signal")),
         .expected = fmt::format("how far {} may move while it does not change", moves_with),
         .found = "null",
         .advice = "calibrate the monitor with --signal 'A moves with B'"});
  return {.name = object.text("signal"),
          .lowest = limit_of(object, "lowest", -kInfinity),
          .highest = limit_of(object, "highest", kInfinity),
          .largest_rate = limit_of(object, "largest_rate", kInfinity),
          .longest_age_s = limit_of(object, "longest_age_s", kInfinity),
          .turn = object.number("turn"),
          .moves_with = moves_with,
          .largest_hidden_travel = largest_hidden_travel};
}

ordered_json pair_json(const PairLimits& pair, const std::vector<std::string>& sources) {
  return {{"first", sources.at(pair.first)},
          {"second", sources.at(pair.second)},
          {"factor", pair.factor},
          {"floor_Nm", pair.floor_Nm},
          {"ceiling_Nm", json_number(pair.ceiling_Nm)},
          {"largest_armed_Nm", json_number(pair.largest_armed_Nm)},
          {"drift_allowance", pair.drift_allowance},
          {"drift_limit_s", json_number(pair.drift_limit_s)}};
}

std::uint8_t source_index(const std::vector<std::string>& sources, const std::string& name,
                          const std::string& place) {
  const auto found = std::ranges::find(sources, name);
  if (found == sources.end())
    throw Error({.place = place,
                 .expected = fmt::format("one of {}", fmt::join(sources, ", ")),
                 .found = fmt::format("'{}'", name)});
  return static_cast<std::uint8_t>(found - sources.begin());
}

PairLimits pair_of(const JsonObject& object, const std::vector<std::string>& sources,
                   const std::string& place) {
  object.allow_only({"first", "second", "factor", "floor_Nm", "ceiling_Nm", "largest_armed_Nm",
                     "drift_allowance", "drift_limit_s"});
  return {.first = source_index(sources, object.text("first"), place),
          .second = source_index(sources, object.text("second"), place),
          .factor = object.number("factor"),
          .floor_Nm = object.number("floor_Nm"),
          .ceiling_Nm = limit_of(object, "ceiling_Nm", kInfinity),
          .largest_armed_Nm = limit_of(object, "largest_armed_Nm", kInfinity),
          .drift_allowance = object.number("drift_allowance"),
          .drift_limit_s = limit_of(object, "drift_limit_s", kInfinity)};
}

/// A pair that is not in the file would never be compared.
void check_every_pair(const MonitorSettings& monitor, const std::string& place) {
  for (std::size_t i = 0; i < monitor.sources.size(); ++i)
    for (std::size_t j = i + 1; j < monitor.sources.size(); ++j) {
      const auto count = std::ranges::count_if(monitor.pairs, [&](const PairLimits& pair) {
        return std::min(pair.first, pair.second) == i && std::max(pair.first, pair.second) == j;
      });
      if (count != 1)
        throw Error({.place = place,
                     .expected = fmt::format("the pair {}, {} once", monitor.sources[i],
                                             monitor.sources[j]),
                     .found = count == 0 ? std::string("none") : fmt::format("it {} times", count),
                     .advice = "a pair is compared less strictly with a larger floor_Nm"});
    }
}

ordered_json actions_json(const MonitorSettings& settings) {
  ordered_json actions = ordered_json::object();
  for (std::size_t i = 0; i < kMonitorChecks; ++i)
    actions[std::string(name(static_cast<MonitorCheck>(i)))] = name(settings.actions[i]);
  return actions;
}

/// A check that is not named keeps its default.
void read_actions(const std::map<std::string, std::string>& actions, MonitorSettings& settings,
                  const std::string& place) {
  constexpr std::array kActions{MonitorAction::off, MonitorAction::warn, MonitorAction::stop};
  for (const auto& entry : actions) {
    const std::string& check = entry.first;
    std::size_t index = 0;
    while (index < kMonitorChecks && name(static_cast<MonitorCheck>(index)) != check) ++index;
    if (index == kMonitorChecks)
      throw Error({.place = place, .expected = "a check", .found = fmt::format("'{}'", check)});
    const auto* const found = std::ranges::find_if(
        kActions, [&entry](MonitorAction each) { return name(each) == entry.second; });
    if (found == kActions.end())
      throw Error({.place = fmt::format("{}/{}", place, check),
                   .expected = "off, warn or stop",
                   .found = fmt::format("'{}'", entry.second)});
    settings.actions[index] = *found;
  }
}

ordered_json source_json(const TorqueSource& source, const MonitoredSource& models) {
  ordered_json document{
      {"name", source.name}, {"model", models.torque.file}, {"model_hash", models.torque.hash}};
  if (!models.friction.file.empty()) {
    document["friction_model"] = models.friction.file;
    document["friction_model_hash"] = models.friction.hash;
  }
  document["error_bar_factor"] = models.error_bar_factor;
  document["depends_on"] = source.depends_on;
  return document;
}

ordered_json monitor_json(const MonitorFile& file) {
  const MonitorSettings& monitor = file.monitor;
  ordered_json document;
  document["format"] = "torsio monitor";
  document["format_version"] = kMonitorFormatVersion;
  document["torsio_version"] = kVersion;
  document["device_serial"] = file.device_serial;
  document["valid_until"] = file.valid_until;
  document["sample_period_s"] = monitor.sample_period_s;
  document["fault_free_hours"] = file.fault_free_hours;
  document["false_alarms_per_hour"] = json_number(file.false_alarms_per_hour);
  document["is_extrapolated"] = file.is_extrapolated;
  document["recordings"] = ordered_json::array();
  for (const Source& source : file.recordings)
    document["recordings"].push_back({{"file", source.file}, {"sha256", source.sha256}});
  document["sources"] = ordered_json::array();
  for (std::size_t i = 0; i < file.redundancy.sources.size(); ++i)
    document["sources"].push_back(source_json(file.redundancy.sources[i], file.models.at(i)));
  document["correlation"] = file.redundancy.correlation;
  if (!file.redundancy.error_bar_factors.empty())
    document["combination_factors"] = file.redundancy.error_bar_factors;
  document["signals"] = ordered_json::array();
  for (const MonitoredSignal& signal : monitor.signals)
    document["signals"].push_back(signal_json(signal));
  document["pairs"] = ordered_json::array();
  for (const PairLimits& pair : monitor.pairs)
    document["pairs"].push_back(pair_json(pair, monitor.sources));
  document["actions"] = actions_json(monitor);
  document["persistence_s"] = monitor.persistence_s;
  document["release_share"] = monitor.release_share;
  document["longest_loss_s"] = json_number(monitor.longest_loss_s);
  document["longest_fault_s"] = json_number(monitor.longest_fault_s);
  document["longest_warm_up_s"] = json_number(monitor.longest_warm_up_s);
  document["largest_novelty"] = json_number(monitor.largest_novelty);
  document["longest_overrun"] = monitor.longest_overrun;
  document["spikes_in_a_row"] = monitor.spikes_in_a_row;
  document["spike_memory_s"] = json_number(monitor.spike_memory_s);
  document["proof_s"] = monitor.proof_s;
  document["longest_command_age_s"] = json_number(monitor.longest_command_age_s);
  return document;
}

void check_monitor_version(const JsonObject& document, const std::string& place) {
  if (document.optional_text("format") != "torsio monitor")
    throw Error({.place = place,
                 .expected = "a monitor file, as torsio monitor --calibrate writes it",
                 .found = "another JSON document"});
  const std::uint64_t version = document.whole_number("format_version");
  if (version != kMonitorFormatVersion)
    throw Error(
        {.place = place + "/format_version",
         .expected = fmt::format("{}, which torsio {} reads", kMonitorFormatVersion, kVersion),
         .found = fmt::format("{}", version)});
}

MonitorFile file_of(const JsonObject& document, const std::string& place) {
  document.allow_only({"format",
                       "format_version",
                       "torsio_version",
                       "device_serial",
                       "valid_until",
                       "sample_period_s",
                       "fault_free_hours",
                       "false_alarms_per_hour",
                       "is_extrapolated",
                       "recordings",
                       "sources",
                       "correlation",
                       "signals",
                       "pairs",
                       "actions",
                       "persistence_s",
                       "release_share",
                       "longest_loss_s",
                       "longest_fault_s",
                       "longest_warm_up_s",
                       "largest_novelty",
                       "longest_overrun",
                       "spikes_in_a_row",
                       "spike_memory_s",
                       "proof_s",
                       "longest_command_age_s",
                       "combination_factors"});
  MonitorFile file;
  file.device_serial = document.text("device_serial");
  file.valid_until = document.text("valid_until");
  file.fault_free_hours = document.number("fault_free_hours");
  file.false_alarms_per_hour = document.number("false_alarms_per_hour");
  file.is_extrapolated = document.boolean("is_extrapolated");
  file.recordings = document.objects("recordings", [](const JsonObject& source) {
    return Source{source.text("file"), source.text("sha256")};
  });
  file.redundancy.sources = document.objects("sources", [&](const JsonObject& source) {
    source.allow_only({"name", "model", "model_hash", "friction_model", "friction_model_hash",
                       "error_bar_factor", "depends_on"});
    file.models.push_back({.torque = {source.text("model"), source.text("model_hash")},
                           .friction = {source.optional_text("friction_model"),
                                        source.optional_text("friction_model_hash")},
                           .error_bar_factor = source.number("error_bar_factor")});
    return TorqueSource{source.text("name"), source.texts("depends_on")};
  });
  MonitorSettings& monitor = file.monitor;
  for (const TorqueSource& source : file.redundancy.sources) monitor.sources.push_back(source.name);
  file.redundancy.correlation = monitor.correlation = document.numbers("correlation");
  if (document.has("combination_factors"))
    file.redundancy.error_bar_factors = document.numbers("combination_factors");
  monitor.signals = document.objects(
      "signals", [&](const JsonObject& signal) { return signal_of(signal, place + "/signals"); });
  monitor.pairs = document.objects("pairs", [&](const JsonObject& pair) {
    return pair_of(pair, monitor.sources, place + "/pairs");
  });
  check_every_pair(monitor, place + "/pairs");
  read_actions(document.text_map("actions"), monitor, place + "/actions");
  monitor.sample_period_s = document.number("sample_period_s");
  monitor.persistence_s = document.number("persistence_s");
  monitor.release_share = document.number("release_share");
  monitor.longest_loss_s = limit_of(document, "longest_loss_s", kInfinity);
  monitor.longest_fault_s = limit_of(document, "longest_fault_s", kInfinity);
  monitor.largest_novelty = limit_of(document, "largest_novelty", kInfinity);
  const auto count = [&](const char* key) {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(
        document.whole_number(key), std::numeric_limits<std::uint32_t>::max()));
  };
  monitor.longest_overrun = count("longest_overrun");
  monitor.spikes_in_a_row = count("spikes_in_a_row");
  monitor.proof_s = document.number("proof_s");
  read_optional(document, "longest_warm_up_s", monitor.longest_warm_up_s);
  read_optional(document, "spike_memory_s", monitor.spike_memory_s);
  read_optional(document, "longest_command_age_s", monitor.longest_command_age_s);
  return file;
}

std::string today_of(const MonitorFileOptions& options) {
  return options.today.empty() ? today() : options.today;
}

/// Dates of one form compare as text.
void check_date(const std::string& date, const std::string& place) {
  if (!is_date(date))
    throw Error(
        {.place = place, .expected = "a date as 2027-11-22", .found = fmt::format("'{}'", date)});
}

}  // namespace

bool is_date(std::string_view text) noexcept {
  constexpr std::string_view kForm = "0000-00-00";
  if (text.size() != kForm.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (kForm[i] == '-' ? text[i] != '-' : text[i] < '0' || text[i] > '9') return false;
  const auto number = [&](std::size_t begin, std::size_t end) {
    unsigned value = 0;
    for (std::size_t i = begin; i < end; ++i)
      value = 10 * value + static_cast<unsigned>(text[i] - '0');
    return value;
  };
  return std::chrono::year_month_day(std::chrono::year(static_cast<int>(number(0, 4))),
                                     std::chrono::month(number(5, 7)),
                                     std::chrono::day(number(8, 10)))
      .ok();
}

std::string today() {
  const std::chrono::year_month_day day =
      std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(day.year()),
                     static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()));
}

std::string model_hash(const std::filesystem::path& model) {
  return fmt::format("{:016x}", text_hash(text_of(read_whole_file(model, kMaxModelFileBytes))));
}

void save_monitor(const std::filesystem::path& path, const MonitorFile& file) {
  const Redundancy redundancy(file.redundancy);
  const Monitor monitor(file.monitor);
  if (!file.valid_until.empty()) check_date(file.valid_until, "valid_until");
  const std::string text =
      monitor_json(file).dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  write_whole_file(path, std::as_bytes(std::span(text)));
}

MonitorFile read_monitor(const std::filesystem::path& path) {
  const std::string place = path.string();
  const std::vector<std::byte> bytes = read_whole_file(path, kMaxFileBytes);
  const json parsed = parse_json(text_of(bytes), place, kMonitorAdvice);
  const JsonObject document(parsed, place, kMonitorAdvice);
  check_monitor_version(document, place);
  MonitorFile file = file_of(document, place);
  if (!file.valid_until.empty()) check_date(file.valid_until, place + "/valid_until");
  const Redundancy redundancy(file.redundancy);
  const Monitor monitor(file.monitor);
  return file;
}

MonitoredTorque load_monitor(const std::filesystem::path& path, const MonitorFileOptions& options) {
  const std::string place = path.string();
  const MonitorFile file = read_monitor(path);
  if (!options.serial.empty() && options.serial != file.device_serial)
    throw Error(
        {.place = place,
         .expected = fmt::format("the monitor of device '{}'", options.serial),
         .found = file.device_serial.empty() ? std::string("one that states no device")
                                             : fmt::format("that of '{}'", file.device_serial),
         .advice = "the limits of a monitor hold for the joint on which they were calibrated"});
  if (!file.valid_until.empty()) {
    const std::string today = today_of(options);
    check_date(today, "today");
    if (today > file.valid_until)
      throw Error({.place = place,
                   .problem = fmt::format("the calibration expired on {}, today is {}",
                                          file.valid_until, today),
                   .advice = "calibrate the monitor again"});
  }
  const double rate_Hz = 1.0 / file.monitor.sample_period_s;
  if (!std::isnan(options.rate_Hz) &&
      !(std::abs(options.rate_Hz / rate_Hz - 1.0) <= kRateTolerance))
    throw Error({.place = place,
                 .expected = fmt::format("a loop at {} Hz, for which the limits hold", rate_Hz),
                 .found = fmt::format("{} Hz", options.rate_Hz)});
  const auto estimator = [&](const MonitoredModel& model) {
    const std::filesystem::path name = path.parent_path() / model.file;
    if (const std::string hash = model_hash(name); hash != model.hash)
      throw Error({.place = name.string(),
                   .expected = fmt::format("the model of the calibration, hash {}", model.hash),
                   .found = "hash " + hash,
                   .advice = "restore the model file, or calibrate the monitor again"});
    ModelFile loaded = load_model(name);
    const std::string& serial = loaded.card.device_serial;
    if (!serial.empty() && !options.serial.empty() && serial != options.serial)
      throw Error({.place = name.string() + ": device_serial",
                   .expected = fmt::format("'{}'", options.serial),
                   .found = fmt::format("'{}'", serial)});
    return make_estimator(loaded, rate_Hz);
  };
  std::vector<SourceModel> sources;
  for (const MonitoredSource& models : file.models) {
    SourceModel source{.torque = estimator(models.torque),
                       .error_bar_factor = models.error_bar_factor};
    if (!models.friction.file.empty()) source.friction = estimator(models.friction);
    sources.push_back(std::move(source));
  }
  return {TorqueSources(std::move(sources)), file.redundancy, file.monitor};
}

}  // namespace torsio
