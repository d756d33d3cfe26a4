#include "store/schema.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

#include <array>
#include <cstddef>

#include "torsio/core/version.hpp"

namespace torsio {
namespace {

constexpr std::int64_t kSchemaLock = 0x746f7273'696f0001;  // "torsio", and a number of its locks

/// Version 1: studies, their trials and results.
constexpr std::string_view kVersion1 = R"sql(
CREATE TABLE schema_version(
  version BIGINT PRIMARY KEY,
  applied_at DOUBLE PRECISION NOT NULL,
  torsio_version TEXT NOT NULL);
CREATE TABLE studies(
  id {counted_key},
  name TEXT NOT NULL UNIQUE,
  kind TEXT NOT NULL,
  spec TEXT NOT NULL,
  torsio_version TEXT NOT NULL,
  trials BIGINT NOT NULL DEFAULT 0,
  total_priority DOUBLE PRECISION NOT NULL DEFAULT 0,
  created_at DOUBLE PRECISION NOT NULL);
CREATE TABLE trials(
  id {counted_key},
  study BIGINT NOT NULL REFERENCES studies(id),
  key TEXT NOT NULL,
  spec TEXT NOT NULL,
  family TEXT NOT NULL,
  device TEXT NOT NULL,
  step BIGINT NOT NULL,
  priority DOUBLE PRECISION NOT NULL,
  state BIGINT NOT NULL DEFAULT 0,
  attempt BIGINT NOT NULL DEFAULT 0,
  lost BIGINT NOT NULL DEFAULT 0,
  worker TEXT NOT NULL DEFAULT '',
  lease_until DOUBLE PRECISION NOT NULL DEFAULT 0,
  reason TEXT NOT NULL DEFAULT '',
  UNIQUE(study, key, step));
CREATE INDEX trials_waiting ON trials(study, priority DESC, id) WHERE state = 0;
CREATE INDEX trials_running ON trials(study, lease_until) WHERE state = 1;
CREATE INDEX trials_unfinished ON trials(study, family, step) WHERE state < 2;
CREATE INDEX trials_of_device ON trials(device, id) WHERE device <> '';
CREATE TABLE results(
  trial BIGINT PRIMARY KEY REFERENCES trials(id),
  study BIGINT NOT NULL REFERENCES studies(id),
  attempt BIGINT NOT NULL,
  value DOUBLE PRECISION,
  result TEXT NOT NULL,
  seconds DOUBLE PRECISION NOT NULL,
  finished_at DOUBLE PRECISION NOT NULL);
CREATE INDEX results_by_value ON results(study, value, trial);
CREATE TABLE samples(
  trial BIGINT PRIMARY KEY REFERENCES trials(id),
  bytes {bytes_type} NOT NULL);
CREATE TABLE steps(
  study BIGINT NOT NULL REFERENCES studies(id),
  family TEXT NOT NULL,
  step BIGINT NOT NULL,
  is_decided BIGINT NOT NULL DEFAULT 0,
  PRIMARY KEY(study, family, step));
)sql";

/// Version 2: devices with their recordings, models and drift. A column with the bytes of a file is the
/// last one, so that the others are read without it.
constexpr std::string_view kVersion2 = R"sql(
CREATE TABLE devices(
  serial TEXT PRIMARY KEY,
  type TEXT NOT NULL,
  note TEXT NOT NULL,
  added_at DOUBLE PRECISION NOT NULL);
{keep_devices}
CREATE TABLE recordings(
  sha256 TEXT PRIMARY KEY,
  device TEXT REFERENCES devices(serial),
  file TEXT NOT NULL,
  samples BIGINT,
  rate_Hz DOUBLE PRECISION,
  added_at DOUBLE PRECISION NOT NULL);
CREATE INDEX recordings_of_device ON recordings(device);
CREATE TABLE models(
  id {counted_key},
  device TEXT NOT NULL REFERENCES devices(serial),
  sha256 TEXT NOT NULL,
  family TEXT NOT NULL,
  file TEXT NOT NULL,
  torsio_version TEXT NOT NULL,
  options TEXT NOT NULL,
  seed TEXT NOT NULL,
  metrics TEXT NOT NULL,
  parent BIGINT REFERENCES models(id),
  trial BIGINT REFERENCES trials(id),
  added_at DOUBLE PRECISION NOT NULL,
  added_by TEXT NOT NULL,
  note TEXT NOT NULL,
  size BIGINT NOT NULL,
  bytes {bytes_type} NOT NULL,
  UNIQUE(device, sha256),
  UNIQUE(device, id));
CREATE INDEX models_of_trial ON models(trial) WHERE trial IS NOT NULL;
CREATE TABLE model_recordings(
  model BIGINT NOT NULL REFERENCES models(id),
  recording TEXT NOT NULL REFERENCES recordings(sha256),
  role TEXT NOT NULL,
  PRIMARY KEY(model, recording, role));
CREATE INDEX models_of_recording ON model_recordings(recording);
CREATE TABLE current_models(
  device TEXT PRIMARY KEY REFERENCES devices(serial),
  model BIGINT NOT NULL,
  since DOUBLE PRECISION NOT NULL,
  FOREIGN KEY(device, model) REFERENCES models(device, id));
CREATE TABLE promotions(
  id {counted_key},
  device TEXT NOT NULL REFERENCES devices(serial),
  model BIGINT NOT NULL,
  action TEXT NOT NULL CHECK(action IN ('promote', 'roll back')),
  made_at DOUBLE PRECISION NOT NULL,
  made_by TEXT NOT NULL,
  reason TEXT NOT NULL,
  request TEXT NOT NULL UNIQUE,
  FOREIGN KEY(device, model) REFERENCES models(device, id));
CREATE INDEX promotions_of_device ON promotions(device, id);
{keep_promotions}
CREATE TABLE drift(
  id {counted_key},
  device TEXT NOT NULL REFERENCES devices(serial),
  model BIGINT NOT NULL,
  recording TEXT NOT NULL REFERENCES recordings(sha256),
  found_at DOUBLE PRECISION NOT NULL,
  verdict TEXT NOT NULL,
  rmse DOUBLE PRECISION,
  bias DOUBLE PRECISION,
  stiffness DOUBLE PRECISION,
  stiffness_error DOUBLE PRECISION,
  friction DOUBLE PRECISION,
  friction_error DOUBLE PRECISION,
  zero DOUBLE PRECISION,
  zero_error DOUBLE PRECISION,
  temperature_C DOUBLE PRECISION,
  details TEXT NOT NULL,
  request TEXT NOT NULL UNIQUE,
  FOREIGN KEY(device, model) REFERENCES models(device, id));
CREATE INDEX drift_of_device ON drift(device, id);
{keep_drift}
)sql";

/// Version 3: the file that a model was transferred from, which need not be in the registry; models and their lineage
/// are kept as they are.
constexpr std::string_view kVersion3 = R"sql(
CREATE TABLE model_bases(
  model BIGINT PRIMARY KEY REFERENCES models(id),
  sha256 TEXT NOT NULL);
CREATE INDEX models_by_hash ON models(sha256);
{keep_models}
{keep_model_recordings}
{keep_model_bases}
)sql";

/// The script of each version, from 1.
constexpr auto kScripts = std::to_array<std::string_view>({kVersion1, kVersion2, kVersion3});
static_assert(kScripts.size() == kStoreVersion);

std::int64_t version_of(Database& database) {
  if (!database.has_table("schema_version")) return 0;
  const auto rows = database.run("SELECT coalesce(max(version), 0) FROM schema_version");
  return std::get<std::int64_t>(rows.front().front());
}

/// Runs the script of a version in the transaction of the caller.
void apply(Database& database, std::int64_t version) {
  fmt::dynamic_format_arg_store<fmt::format_context> words;
  words.push_back(fmt::arg("counted_key", database.counted_key()));
  words.push_back(fmt::arg("bytes_type", database.bytes_type()));
  words.push_back(fmt::arg("keep_devices", database.keep_rows("devices", "serial", "serial")));
  words.push_back(fmt::arg("keep_promotions", database.keep_rows("promotions", "id")));
  words.push_back(fmt::arg("keep_drift", database.keep_rows("drift", "id")));
  words.push_back(fmt::arg("keep_models", database.keep_rows("models", "id")));
  // All its columns are its key: a row that replaces another one is the same.
  words.push_back(fmt::arg("keep_model_recordings", database.keep_rows("model_recordings", {})));
  words.push_back(fmt::arg("keep_model_bases", database.keep_rows("model_bases", "model")));
  database.run_script(fmt::vformat(kScripts.at(static_cast<std::size_t>(version - 1)), words));
  database.run(fmt::format("INSERT INTO schema_version VALUES($1, {}, $2)", database.now()),
               {version, std::string(kVersion)});
}

[[noreturn]] void refuse_version(std::int64_t found, const std::string& place) {
  throw Error({.place = place,
               .problem = "this store was written by another version of torsio",
               .expected = fmt::format("tables of version {}", kStoreVersion),
               .found = fmt::format("version {}", found),
               .advice = found > kStoreVersion
                             ? "Use the torsio that wrote it, or a newer one."
                             : fmt::format("torsio store upgrade --store '{}' adds the new tables "
                                           "and keeps all that it has; older versions of torsio "
                                           "refuse it afterwards.",
                                           place)});
}

}  // namespace

void prepare_schema(Database& database, const std::string& place) {
  if (version_of(database) == 0) upgrade_schema(database, place);
  const std::int64_t found = version_of(database);
  if (found != kStoreVersion) refuse_version(found, place);
}

std::int64_t upgrade_schema(Database& database, const std::string& place, std::int64_t version) {
  const std::int64_t before = version_of(database);
  if (before > version) refuse_version(before, place);
  // Another program may be upgrading, too: the version counts that is found under the lock.
  for (std::int64_t found = before; found < version;) {
    Transaction transaction(database, kSchemaLock);
    found = version_of(database);
    const bool is_empty = found == 0;
    while (found < version) {
      apply(database, ++found);
      if (!is_empty) break;
    }
    transaction.commit();
  }
  return before;
}

}  // namespace torsio
