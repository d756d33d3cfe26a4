#include "store/schema.hpp"

#include <fmt/args.h>
#include <fmt/format.h>

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

std::int64_t version_of(Database& database) {
  if (!database.has_table("schema_version")) return 0;
  const auto rows = database.run("SELECT coalesce(max(version), 0) FROM schema_version");
  return std::get<std::int64_t>(rows.front().front());
}

void create(Database& database) {
  fmt::dynamic_format_arg_store<fmt::format_context> words;
  words.push_back(fmt::arg("counted_key", database.counted_key()));
  words.push_back(fmt::arg("bytes_type", database.bytes_type()));
  database.run_script(fmt::vformat(kVersion1, words));
  database.run(fmt::format("INSERT INTO schema_version VALUES($1, {}, $2)", database.now()),
               {kStoreVersion, std::string(kVersion)});
}

}  // namespace

void prepare_schema(Database& database, const std::string& place) {
  if (version_of(database) == 0) {
    Transaction transaction(database, kSchemaLock);
    if (version_of(database) == 0) create(database);  // no other program was first
    transaction.commit();
  }
  const std::int64_t found = version_of(database);
  if (found == kStoreVersion) return;
  throw Error({.place = place,
               .problem = "this store was written by another version of torsio",
               .expected = fmt::format("tables of version {}", kStoreVersion),
               .found = fmt::format("version {}", found),
               .advice = found > kStoreVersion ? "Use the torsio that wrote it, or a newer one."
                                               : "Use the torsio that wrote it."});
}

}  // namespace torsio
