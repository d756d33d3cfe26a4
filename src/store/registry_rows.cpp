#include "store/registry_rows.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <vector>

#include "core/did_you_mean.hpp"
#include "data/byte_source.hpp"

namespace torsio {

std::int64_t RowReader::whole(std::size_t column) const { return id(column).value_or(0); }

double RowReader::real(std::size_t column) const {
  if (const auto* const integer = std::get_if<std::int64_t>(&row_.at(column)))
    return static_cast<double>(*integer);
  const auto* const found = std::get_if<double>(&row_.at(column));
  return found == nullptr ? kNotMeasured : *found;
}

std::string RowReader::text(std::size_t column) const {
  const auto* const found = std::get_if<std::string>(&row_.at(column));
  return found == nullptr ? std::string() : *found;
}

std::string RowReader::bytes(std::size_t column) const {
  const auto* const found = std::get_if<Blob>(&row_.at(column));
  return found == nullptr ? std::string() : found->bytes;
}

std::optional<std::int64_t> RowReader::id(std::size_t column) const {
  const auto* const found = std::get_if<std::int64_t>(&row_.at(column));
  return found == nullptr ? std::nullopt : std::optional(*found);
}

DatabaseValue number_or_null(double value) {
  if (std::isfinite(value)) return value;
  return std::monostate{};
}

DatabaseValue id_or_null(const std::optional<std::int64_t>& id) {
  if (id) return *id;
  return std::monostate{};
}

DatabaseValue text_or_null(std::string_view text) {
  if (!text.empty()) return std::string(text);
  return std::monostate{};
}

std::string new_request() {
  std::random_device source;
  std::string word;
  for (int k = 0; k < 4; ++k) word += fmt::format("{:08x}", source());
  return word;
}

RegisteredDevice device_from(const RowReader& row) {
  return {
      .serial = row.text(0), .type = row.text(1), .note = row.text(2), .added_at_s = row.real(3)};
}

RegisteredModel model_from(const RowReader& row) {
  RegisteredModel model{.id = row.whole(0),
                        .device = row.text(1),
                        .sha256 = row.text(2),
                        .family = row.text(3),
                        .file = row.text(4),
                        .torsio_version = row.text(5),
                        .seed = row.text(7),
                        .parent = row.id(9),
                        .trial = row.id(10),
                        .added_at_s = row.real(11),
                        .added_by = row.text(12),
                        .note = row.text(13),
                        .size = static_cast<std::size_t>(row.whole(14)),
                        .base_sha256 = row.text(15)};
  model.options = nlohmann::json::parse(row.text(6)).get<std::map<std::string, std::string>>();
  const auto metrics = nlohmann::json::parse(row.text(8));
  for (const auto& [name, value] : metrics.items())
    model.metrics[name] = value.is_number() ? value.get<double>() : kNotMeasured;
  return model;
}

DriftEntry drift_from(const RowReader& row) {
  return {.id = row.whole(0),
          .device = row.text(1),
          .model = row.whole(2),
          .recording = row.text(3),
          .found_at_s = row.real(4),
          .verdict = row.text(5),
          .rmse = row.real(6),
          .bias = row.real(7),
          .stiffness = row.real(8),
          .stiffness_error = row.real(9),
          .friction = row.real(10),
          .friction_error = row.real(11),
          .zero = row.real(12),
          .zero_error = row.real(13),
          .temperature_degC = row.real(14),
          .details = row.text(15)};
}

void require_device(Database& database, std::string_view serial, const std::string& place) {
  if (!database.run("SELECT 1 FROM devices WHERE serial = $1", {std::string(serial)}).empty())
    return;
  std::vector<std::string> known;
  for (const DatabaseRow& row : database.run("SELECT serial FROM devices ORDER BY serial"))
    known.push_back(RowReader(row).text(0));
  std::string advice = did_you_mean(serial, known);
  if (advice.empty())
    advice = known.empty() ? "No device was added yet: torsio store add SERIAL MODEL."
                           : "torsio store list has all devices.";
  throw UsageError({.place = place,
                    .problem = fmt::format("there is no device '{}'", serial),
                    .advice = std::move(advice)});
}

RegisteredModel find_model(Database& database, std::int64_t id, const std::string& place) {
  const auto rows =
      database.run(fmt::format("SELECT {} FROM models m WHERE m.id = $1", kModelColumns), {id});
  if (rows.empty())
    throw UsageError({.place = place,
                      .problem = fmt::format("there is no model {}", id),
                      .advice = "torsio store list --models has all models."});
  return model_from(RowReader(rows.front()));
}

RegisteredModel require_model_of(Database& database, std::string_view serial, std::int64_t id,
                                 const std::string& place) {
  require_device(database, serial, place);
  RegisteredModel model = find_model(database, id, place);
  if (model.device != serial)
    throw UsageError(
        {.place = place,
         .problem = fmt::format("model {} is one of another device", id),
         .expected = fmt::format("a model of {}", serial),
         .found = fmt::format("a model of {}", model.device),
         .advice = fmt::format("torsio store show '{}' has the models of this one.", serial)});
  return model;
}

std::string checked_bytes(Database& database, const RegisteredModel& model,
                          const std::string& place) {
  const auto rows = database.run("SELECT bytes FROM models WHERE id = $1", {model.id});
  std::string bytes = rows.empty() ? std::string() : RowReader(rows.front()).bytes(0);
  if (const std::string found = sha256_hex(bytes); found != model.sha256)
    throw Error({.place = fmt::format("{}: model {} of {}", place, model.id, model.device),
                 .problem = "its bytes have changed since it was added",
                 .expected = "SHA-256 " + model.sha256,
                 .found = found,
                 .advice = "Roll back to another model, and restore the store from a backup."});
  return bytes;
}

}  // namespace torsio
