#include "store/store_text.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>

#include "torsio/report/text_table.hpp"

namespace {

using Json = nlohmann::ordered_json;

/// @param format of fmt, for a time in UTC
std::string utc_text(double time_s, const char* format) {
  if (!std::isfinite(time_s)) return {};
  return fmt::format(fmt::runtime(format), fmt::gmtime(static_cast<std::time_t>(time_s)));
}
std::string minute_of(double time_s) { return utc_text(time_s, "{:%Y-%m-%d %H:%M}"); }
Json json_of_time(double time_s) {
  if (!std::isfinite(time_s)) return nullptr;
  return utc_text(time_s, "{:%Y-%m-%dT%H:%M:%SZ}");
}

std::string short_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.4g}", value) : std::string();
}
/// A relative change with its standard error, both in percent.
std::string percent_text(double share, double error) {
  if (!std::isfinite(share)) return {};
  return std::isfinite(error) ? fmt::format("{:+.1f} +- {:.1f}", 100.0 * share, 100.0 * error)
                              : fmt::format("{:+.1f}", 100.0 * share);
}
std::string change_text(double change, double error) {
  if (!std::isfinite(change)) return {};
  return std::isfinite(error) ? fmt::format("{:+.3g} +- {:.2g}", change, error)
                              : fmt::format("{:+.3g}", change);
}

std::string rmse_of(const torsio::RegisteredModel& model) {
  const auto rmse = model.metrics.find("rmse");
  return rmse == model.metrics.end() ? std::string() : short_number(rmse->second);
}
std::string id_text(const std::optional<std::int64_t>& id) {
  return id ? fmt::format("{}", *id) : std::string();
}
/// Enough of a hash to find it again.
std::string short_hash(const std::string& sha256) { return sha256.substr(0, 12); }

/// The model from whose file another one was transferred.
std::string base_text(const torsio::RegisteredModel& model,
                      std::span<const torsio::RegisteredModel> bases) {
  const auto base = std::ranges::find(bases, model.base_sha256, &torsio::RegisteredModel::sha256);
  return base == bases.end()
             ? fmt::format("a file that is not in this store, SHA-256 {}", model.base_sha256)
             : fmt::format("model {} ({}) of {}, SHA-256 {}", base->id, base->family, base->device,
                           short_hash(base->sha256));
}

std::string promotions_text(std::span<const torsio::Promotion> promotions) {
  torsio::TextTable table;
  table.header({"time (UTC)", "action", "model", "by", "reason"});
  for (const torsio::Promotion& each : promotions)
    table.row({minute_of(each.made_at_s), each.is_roll_back ? "roll back" : "promote",
               fmt::format("{}", each.model), each.made_by, each.reason});
  return table.text();
}

std::string drift_rows_text(std::span<const torsio::DriftEntry> history) {
  torsio::TextTable table;
  table.header({"time (UTC)", "verdict", "model", "RMSE", "bias", "stiffness in %", "friction in %",
                "zero", "temperature in C", "recording"});
  for (const torsio::DriftEntry& each : history)
    table.row({minute_of(each.found_at_s), each.verdict, fmt::format("{}", each.model),
               short_number(each.rmse), short_number(each.bias),
               percent_text(each.stiffness, each.stiffness_error),
               percent_text(each.friction, each.friction_error),
               change_text(each.zero, each.zero_error), short_number(each.temperature_degC),
               short_hash(each.recording)});
  return table.text();
}

Json json_of_promotion(const torsio::Promotion& promotion) {
  return {{"id", promotion.id},       {"action", promotion.is_roll_back ? "roll back" : "promote"},
          {"model", promotion.model}, {"time", json_of_time(promotion.made_at_s)},
          {"by", promotion.made_by},  {"reason", promotion.reason}};
}

Json json_of_drift(const torsio::DriftEntry& entry) {
  Json details = Json::parse(entry.details, nullptr, false);
  if (details.is_discarded()) details = nullptr;
  return {{"id", entry.id},
          {"time", json_of_time(entry.found_at_s)},
          {"model", entry.model},
          {"recording", entry.recording},
          {"verdict", entry.verdict},
          {"rmse", entry.rmse},
          {"bias", entry.bias},
          {"stiffness", entry.stiffness},
          {"stiffness_error", entry.stiffness_error},
          {"friction", entry.friction},
          {"friction_error", entry.friction_error},
          {"zero", entry.zero},
          {"zero_error", entry.zero_error},
          {"temperature_degC", entry.temperature_degC},
          {"details", std::move(details)}};
}

template <class Items>
Json list_of(const Items& items, Json (*one)(const typename Items::value_type&)) {
  Json list = Json::array();
  for (const auto& each : items) list.push_back(one(each));
  return list;
}

}  // namespace

std::string devices_text(std::span<const torsio::DeviceSummary> devices) {
  torsio::TextTable table;
  table.header({"device", "type", "model", "family", "since (UTC)", "last drift", "time (UTC)",
                "models", "recordings"});
  for (const torsio::DeviceSummary& each : devices)
    table.row({each.device.serial, each.device.type,
               each.current ? fmt::format("{}", each.current->id) : "",
               each.current ? each.current->family : "", minute_of(each.current_since_s),
               each.last_drift ? each.last_drift->verdict : "",
               each.last_drift ? minute_of(each.last_drift->found_at_s) : "",
               fmt::format("{}", each.models), fmt::format("{}", each.recordings)});
  return table.text();
}

std::string models_text(std::span<const torsio::RegisteredModel> models, bool with_device) {
  torsio::TextTable table;
  table.header({"model"});
  if (with_device) table.header({"device"});
  table.header(
      {"family", "RMSE", "parent", "base", "added (UTC)", "by", "file", "SHA-256", "note"});
  for (const torsio::RegisteredModel& each : models) {
    std::vector<std::string> row{fmt::format("{}", each.id)};
    if (with_device) row.push_back(each.device);
    row.insert(row.end(), {each.family, rmse_of(each), id_text(each.parent),
                           short_hash(each.base_sha256), minute_of(each.added_at_s), each.added_by,
                           std::filesystem::path(each.file).filename().string(),
                           short_hash(each.sha256), each.note});
    table.row(std::move(row));
  }
  return table.text();
}

std::string recordings_text(std::span<const torsio::RegisteredRecording> recordings) {
  torsio::TextTable table;
  table.header({"SHA-256", "device", "samples", "rate in Hz", "added (UTC)", "file"});
  for (const torsio::RegisteredRecording& each : recordings)
    table.row({short_hash(each.sha256), each.device,
               each.samples == 0 ? "" : fmt::format("{}", each.samples), short_number(each.rate_Hz),
               minute_of(each.added_at_s), each.file});
  return table.text();
}

std::string device_text(const DeviceRecord& record) {
  const torsio::RegisteredDevice& device = record.device;
  std::string text =
      fmt::format("device {}{}, added {} UTC\n", device.serial,
                  device.type.empty() ? "" : ", type " + device.type, minute_of(device.added_at_s));
  if (!device.note.empty()) text += device.note + "\n";
  if (record.lineage.empty()) {
    text += "no model is current\n";
  } else {
    std::vector<std::string> steps;
    steps.reserve(record.lineage.size());
    for (const torsio::RegisteredModel& each : record.lineage)
      steps.push_back(fmt::format("model {} ({}{})", each.id, each.family,
                                  each.device == device.serial ? "" : " of " + each.device));
    text += fmt::format("current: {}\n", fmt::join(steps, ", made from "));
  }
  for (const torsio::RegisteredModel& each :
       record.lineage.empty() ? record.models : record.lineage)
    if (!each.base_sha256.empty())
      text += fmt::format("base of model {}: {}\n", each.id, base_text(each, record.bases));
  if (!record.models.empty()) text += "\nmodels\n" + models_text(record.models, false);
  if (!record.promotions.empty()) text += "\npromotions\n" + promotions_text(record.promotions);
  if (!record.drift.empty()) text += "\ndrift\n" + drift_rows_text(record.drift);
  if (!record.recordings.empty()) text += "\nrecordings\n" + recordings_text(record.recordings);
  return text;
}

Json store_json(const torsio::RegisteredDevice& device) {
  return {{"serial", device.serial},
          {"type", device.type},
          {"note", device.note},
          {"added", json_of_time(device.added_at_s)}};
}

Json store_json(const torsio::RegisteredModel& model) {
  Json recordings = Json::array();
  for (const torsio::RecordingUse& use : model.recordings)
    recordings.push_back({{"sha256", use.sha256}, {"role", use.role}});
  return {{"id", model.id},
          {"device", model.device},
          {"family", model.family},
          {"file", model.file},
          {"sha256", model.sha256},
          {"bytes", model.size},
          {"torsio_version", model.torsio_version},
          {"options", model.options},
          {"seed", model.seed},
          {"metrics", model.metrics},
          {"parent", model.parent ? Json(*model.parent) : Json()},
          {"base_sha256", model.base_sha256.empty() ? Json() : Json(model.base_sha256)},
          {"trial", model.trial ? Json(*model.trial) : Json()},
          {"added", json_of_time(model.added_at_s)},
          {"by", model.added_by},
          {"note", model.note},
          {"recordings", std::move(recordings)}};
}

Json store_json(const torsio::RegisteredRecording& recording) {
  return {{"sha256", recording.sha256},
          {"device", recording.device.empty() ? Json() : Json(recording.device)},
          {"file", recording.file},
          {"samples", recording.samples == 0 ? Json() : Json(recording.samples)},
          {"rate_Hz", recording.rate_Hz},
          {"added", json_of_time(recording.added_at_s)}};
}

Json store_json(const torsio::DeviceSummary& summary) {
  Json json = store_json(summary.device);
  json["current"] = summary.current ? store_json(*summary.current) : Json();
  json["current_since"] = json_of_time(summary.current_since_s);
  json["last_drift"] = summary.last_drift ? json_of_drift(*summary.last_drift) : Json();
  json["models"] = summary.models;
  json["recordings"] = summary.recordings;
  return json;
}

Json store_json(const DeviceRecord& record) {
  Json json{{"device", store_json(record.device)}};
  Json lineage = Json::array();
  for (const torsio::RegisteredModel& each : record.lineage) lineage.push_back(each.id);
  json["current"] = record.lineage.empty() ? Json() : Json(record.lineage.front().id);
  json["lineage"] = std::move(lineage);
  json["models"] = list_of(record.models, store_json);
  json["promotions"] = list_of(record.promotions, json_of_promotion);
  json["drift"] = list_of(record.drift, json_of_drift);
  json["recordings"] = list_of(record.recordings, store_json);
  return json;
}
