#include "torsio/store/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>
#include <system_error>
#include <utility>

#include "core/did_you_mean.hpp"
#include "data/byte_source.hpp"
#include "store/registry_rows.hpp"
#include "store/schema.hpp"
#include "store/store_connection.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSerialBytes = 200;

void require_serial(std::string_view serial, const std::string& place) {
  const bool is_printable = std::ranges::all_of(serial, [](char c) {
    constexpr unsigned char kSpace = 0x20;
    constexpr unsigned char kDelete = 0x7f;
    const auto byte = static_cast<unsigned char>(c);
    return byte >= kSpace && byte != kDelete;
  });
  if (!serial.empty() && serial.size() <= kMaxSerialBytes && is_printable &&
      serial.front() != ' ' && serial.back() != ' ')
    return;
  throw UsageError(
      {.place = place,
       .problem = "this cannot be the serial number of a device",
       .expected = fmt::format("1 to {} characters without line breaks", kMaxSerialBytes),
       .found = serial.empty() ? "nothing" : fmt::format("\"{}\"", serial)});
}

/// A file that is given to a registry has to be one of the device. @throws Error
ModelFile parse_model_of(const NewModel& model) {
  ModelFile parsed = parse_model(std::as_bytes(std::span(model.bytes)), model.file);
  const std::string& found = parsed.card.device_serial;
  if (found == model.device) return parsed;
  if (found.empty())
    throw Error(
        {.place = model.file,
         .problem = "the model has no serial number, so that it may be one of any device",
         .expected = model.device,
         .advice = fmt::format("Fit it with torsio fit --device-serial '{}'.", model.device)});
  throw Error(
      {.place = model.file,
       .problem = "this is a model of another device",
       .expected = model.device,
       .found = found,
       .advice = fmt::format(
           "Add it to its own device: torsio store add '{}'. A serial number is the identity of a "
           "device: a joint that was given another one is another device, without the history of "
           "the old one, and its models are fitted again.",
           found)});
}

/// The training files of a model's card that have a hash, by their absolute paths where they are.
std::vector<RegisteredRecording> training_recordings(const ModelCard& card) {
  std::vector<RegisteredRecording> recordings;
  recordings.reserve(card.training_files.size());
  for (const Source& source : card.training_files) {
    if (source.sha256.empty()) continue;
    RegisteredRecording recording{.sha256 = source.sha256, .file = source.file};
    std::error_code absent;
    try {
      if (fs::is_regular_file(source.file, absent) && sha256_of_file(source.file) == source.sha256)
        recording.file = fs::absolute(source.file).lexically_normal().string();
    } catch (const Error&) {  // it cannot be read: its name remains as on the card
    }
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

std::string text_of_options(const std::map<std::string, std::string>& options) {
  return nlohmann::json(options).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string text_of_metrics(const std::map<std::string, double>& metrics) {
  return nlohmann::json(metrics).dump();  // NaN becomes null
}

/// Rows of one device, or of all if `serial` is empty: `condition` replaces {} in the statement.
std::vector<DatabaseRow> rows_of(Database& database, std::string_view serial, std::string_view sql,
                                 std::string_view condition) {
  if (serial.empty()) return database.run(fmt::format(fmt::runtime(sql), ""));
  return database.run(fmt::format(fmt::runtime(sql), condition), {std::string(serial)});
}

void read_recordings_of(Database& database, RegisteredModel& model) {
  for (const DatabaseRow& row : database.run(
           "SELECT recording, role FROM model_recordings WHERE model = $1 ORDER BY role, recording",
           {model.id}))
    model.recordings.push_back({RowReader(row).text(0), RowReader(row).text(1)});
}

/// Enters a recording, or what was not known of one that is there.
void enter_recording(Database& database, const RegisteredRecording& recording,
                     const std::string& place) {
  const DatabaseValue samples =
      recording.samples == 0 ? DatabaseValue{} : static_cast<std::int64_t>(recording.samples);
  const auto rows =
      database.run("SELECT device FROM recordings WHERE sha256 = $1", {recording.sha256});
  if (rows.empty()) {
    database.run(fmt::format("INSERT INTO recordings(sha256, device, file, samples, rate_Hz, "
                             "added_at) VALUES($1, $2, $3, $4, $5, {})",
                             database.now()),
                 {recording.sha256, text_or_null(recording.device), recording.file, samples,
                  number_or_null(recording.rate_Hz)});
    return;
  }
  const std::string device = RowReader(rows.front()).text(0);
  if (!device.empty() && !recording.device.empty() && device != recording.device)
    throw Error({.place = recording.file,
                 .problem = "this recording is one of another device",
                 .expected = recording.device,
                 .found = device,
                 .advice = fmt::format("{} has it by its SHA-256 {}.", place, recording.sha256)});
  // A path is worth keeping only if another folder of work does not change what it names.
  const bool has_path = recording.file.starts_with('/');
  database.run(
      "UPDATE recordings SET device = coalesce($2, device), file = coalesce($3, file), "
      "samples = coalesce($4, samples), rate_Hz = coalesce($5, rate_Hz) WHERE sha256 = $1",
      {recording.sha256, text_or_null(recording.device),
       text_or_null(has_path ? recording.file : std::string()), samples,
       number_or_null(recording.rate_Hz)});
}

std::int64_t insert_model(Database& database, const NewModel& model, const ModelFile& parsed,
                          const std::string& sha256) {
  const auto rows = database.run(
      fmt::format(
          "INSERT INTO models(device, sha256, family, file, torsio_version, options, seed, "
          "metrics, parent, trial, added_at, added_by, note, size, bytes) "
          "VALUES($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, {}, $11, $12, $13, $14) RETURNING id",
          database.now()),
      {model.device, sha256, std::string(parsed.parameters.family()), model.file,
       parsed.card.torsio_version, text_of_options(parsed.card.options),
       std::to_string(parsed.card.seed), text_of_metrics(parsed.card.metrics),
       id_or_null(model.parent), id_or_null(model.trial), model.by, model.note,
       static_cast<std::int64_t>(model.bytes.size()), Blob{model.bytes}});
  const std::int64_t id = RowReader(rows.front()).whole(0);
  if (!model.base_sha256.empty())
    database.run("INSERT INTO model_bases(model, sha256) VALUES($1, $2)", {id, model.base_sha256});
  return id;
}

}  // namespace

Registry::Registry(const StoreAddress& address, StudyStore::OnWait on_wait)
    : address_(address),
      connection_(std::make_unique<StoreConnection>(address, std::move(on_wait))) {
  // Unlike a trial, a promotion is not made again after a power cut.
  if (address.kind == StoreAddress::Kind::sqlite)
    connection_->run([](Database& database) { database.run("PRAGMA synchronous=FULL"); });
}
Registry::~Registry() = default;

bool Registry::add_device(const RegisteredDevice& device) {
  require_serial(device.serial, address_.name());
  return connection_->run([&](Database& database) {
    Transaction transaction(database, kRegistryLock);
    const auto rows = database.run("SELECT type FROM devices WHERE serial = $1", {device.serial});
    if (rows.empty()) {
      database.run(fmt::format("INSERT INTO devices(serial, type, note, added_at) "
                               "VALUES($1, $2, $3, {})",
                               database.now()),
                   {device.serial, device.type, device.note});
      transaction.commit();
      return true;
    }
    const std::string type = RowReader(rows.front()).text(0);
    if (!type.empty() && !device.type.empty() && type != device.type)
      throw Error({.place = address_.name() + ": device " + device.serial,
                   .problem = "its type cannot change: models and drift were found for this one",
                   .expected = type,
                   .found = device.type,
                   .advice = "A joint that was built into another one is another device, with a "
                             "serial number of its own."});
    database.run(
        "UPDATE devices SET type = coalesce($2, type), note = coalesce($3, note) WHERE serial = $1",
        {device.serial, text_or_null(device.type), text_or_null(device.note)});
    transaction.commit();
    return false;
  });
}

RegisteredDevice Registry::device(std::string_view serial) {
  return connection_->run([&](Database& database) {
    require_device(database, serial, address_.name());
    return device_from(RowReader(
        database
            .run(fmt::format("SELECT {} FROM devices d WHERE d.serial = $1", kDeviceColumns),
                 {std::string(serial)})
            .front()));
  });
}

std::vector<RegisteredDevice> Registry::devices() {
  return connection_->run([&](Database& database) {
    std::vector<RegisteredDevice> all;
    for (const DatabaseRow& row :
         database.run(fmt::format("SELECT {} FROM devices d ORDER BY d.serial", kDeviceColumns)))
      all.push_back(device_from(RowReader(row)));
    return all;
  });
}

void Registry::add_recording(const RegisteredRecording& recording) {
  if (recording.sha256.empty())
    throw Error({.place = recording.file,
                 .problem = "a recording of several files has no hash by which it is known again",
                 .advice = "Write it into one file: torsio convert."});
  connection_->run([&](Database& database) {
    if (!recording.device.empty()) require_device(database, recording.device, address_.name());
    Transaction transaction(database, kRegistryLock);
    enter_recording(database, recording, address_.name());
    transaction.commit();
  });
}

std::vector<RegisteredRecording> Registry::recordings(std::string_view serial) {
  return connection_->run([&](Database& database) {
    if (!serial.empty()) require_device(database, serial, address_.name());
    std::vector<RegisteredRecording> all;
    for (const DatabaseRow& each :
         rows_of(database, serial,
                 "SELECT sha256, device, file, samples, rate_Hz, added_at FROM recordings {} "
                 "ORDER BY added_at, sha256",
                 "WHERE sha256 IN (SELECT sha256 FROM recordings WHERE device = $1 UNION SELECT "
                 "r.recording FROM model_recordings r JOIN models m ON m.id = r.model WHERE "
                 "m.device = $1)")) {
      const RowReader row(each);
      all.push_back({.sha256 = row.text(0),
                     .device = row.text(1),
                     .file = row.text(2),
                     .samples = static_cast<std::size_t>(row.whole(3)),
                     .rate_Hz = row.real(4),
                     .added_at_s = row.real(5)});
    }
    return all;
  });
}

std::int64_t Registry::add_model(const NewModel& model) {
  const ModelFile parsed = parse_model_of(model);
  const std::string sha256 = sha256_hex(model.bytes);
  const std::vector<RegisteredRecording> trained = training_recordings(parsed.card);
  std::vector<RecordingUse> uses = model.recordings;
  for (const RegisteredRecording& recording : trained) uses.push_back({recording.sha256, "train"});
  return connection_->run([&](Database& database) {
    require_device(database, model.device, address_.name());
    if (model.parent) (void)find_model(database, *model.parent, address_.name());
    Transaction transaction(database, kRegistryLock);
    const auto known = database.run("SELECT id FROM models WHERE device = $1 AND sha256 = $2",
                                    {model.device, sha256});
    if (!known.empty()) return RowReader(known.front()).whole(0);
    for (const RegisteredRecording& recording : trained)
      enter_recording(database, recording, address_.name());
    const std::int64_t id = insert_model(database, model, parsed, sha256);
    for (const RecordingUse& use : uses) {
      if (database.run("SELECT 1 FROM recordings WHERE sha256 = $1", {use.sha256}).empty())
        throw Error({.place = model.file,
                     .problem = fmt::format("its recording {} is not in the registry", use.sha256),
                     .advice = "Add the recording first."});
      database.run(
          "INSERT INTO model_recordings(model, recording, role) VALUES($1, $2, $3) "
          "ON CONFLICT(model, recording, role) DO NOTHING",
          {id, use.sha256, use.role});
    }
    transaction.commit();
    return id;
  });
}

RegisteredModel Registry::model(std::int64_t id) {
  return connection_->run([&](Database& database) {
    RegisteredModel found = find_model(database, id, address_.name());
    read_recordings_of(database, found);
    return found;
  });
}

std::vector<RegisteredModel> Registry::models(std::string_view serial) {
  return connection_->run([&](Database& database) {
    if (!serial.empty()) require_device(database, serial, address_.name());
    std::vector<RegisteredModel> all;
    for (const DatabaseRow& row :
         rows_of(database, serial,
                 fmt::format("SELECT {} FROM models m {{}} ORDER BY m.id", kModelColumns),
                 "WHERE m.device = $1"))
      all.push_back(model_from(RowReader(row)));
    // In the same order, so that both lists are followed side by side.
    auto model = all.begin();
    for (const DatabaseRow& each :
         rows_of(database, serial,
                 "SELECT r.model, r.recording, r.role FROM model_recordings r {} "
                 "ORDER BY r.model, r.role, r.recording",
                 "JOIN models m ON m.id = r.model WHERE m.device = $1")) {
      const RowReader row(each);
      while (model != all.end() && model->id < row.whole(0)) ++model;
      if (model == all.end()) break;  // it was added in between
      if (model->id == row.whole(0)) model->recordings.push_back({row.text(1), row.text(2)});
    }
    return all;
  });
}

std::vector<RegisteredModel> Registry::lineage(std::int64_t id) {
  std::vector<RegisteredModel> models{model(id)};
  while (models.back().parent) models.push_back(model(*models.back().parent));
  return models;
}

std::optional<RegisteredModel> Registry::model_of_file(std::string_view sha256) {
  return connection_->run([&](Database& database) -> std::optional<RegisteredModel> {
    const auto rows = database.run(
        fmt::format("SELECT {} FROM models m WHERE m.sha256 = $1 ORDER BY m.id LIMIT 1",
                    kModelColumns),
        {std::string(sha256)});
    if (rows.empty()) return std::nullopt;
    return model_from(RowReader(rows.front()));
  });
}

std::string Registry::model_bytes(std::string_view serial, std::int64_t id) {
  return connection_->run([&](Database& database) {
    return checked_bytes(database, require_model_of(database, serial, id, address_.name()),
                         address_.name());
  });
}

void require_own_model(const NewModel& model) { (void)parse_model_of(model); }

StoreUpgrade upgrade_store(const StoreAddress& address) {
  const auto database = open_database(address);
  return {.before = upgrade_schema(*database, address.name()), .after = kStoreVersion};
}

}  // namespace torsio
