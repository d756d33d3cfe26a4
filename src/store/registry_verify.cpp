// What `torsio store verify` checks.
#include <fmt/format.h>

#include <filesystem>
#include <span>
#include <system_error>

#include "core/report_progress.hpp"
#include "data/byte_source.hpp"
#include "store/registry_history.hpp"
#include "store/registry_rows.hpp"
#include "store/store_connection.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/store/registry.hpp"

namespace torsio {
namespace {

using Findings = std::vector<RegistryFinding>;

/// SQLite's own check; a server checks what it reads by itself.
void check_pages(Database& database, const StoreAddress& address, Findings& findings) {
  if (address.kind == StoreAddress::Kind::postgresql) return;
  for (const DatabaseRow& row : database.run("PRAGMA integrity_check"))
    if (const std::string text = RowReader(row).text(0); text != "ok")
      findings.push_back({.place = address.name(), .text = text});
  for (const DatabaseRow& row : database.run("PRAGMA foreign_key_check"))
    findings.push_back({.place = address.name(),
                        .text = fmt::format("row {} of {} names a row of {} that is not there",
                                            RowReader(row).whole(1), RowReader(row).text(0),
                                            RowReader(row).text(2))});
}

/// Hash, format and serial number of one model.
void check_model(Database& database, std::int64_t id, const std::string& store,
                 Findings& findings) {
  std::string place = fmt::format("model {}", id);
  try {
    const RegisteredModel model = find_model(database, id, store);
    place += " of " + model.device;
    const std::string bytes = checked_bytes(database, model, store);
    const ModelFile parsed = parse_model(std::as_bytes(std::span(bytes)), model.file, model.device);
    if (parsed.card.device_serial.empty())
      findings.push_back({.place = place, .text = "its file has no serial number"});
  } catch (const ConnectionLost&) {
    throw;
  } catch (const Error& error) {
    const ErrorReport& report = error.report();
    findings.push_back(
        {.place = place,
         .text = report.problem.empty()
                     ? std::string(error.what())
                     : fmt::format("{}{}{}", report.problem,
                                   report.expected.empty() ? "" : ": expected " + report.expected,
                                   report.found.empty() ? "" : ", found " + report.found)});
  }
}

/// The current model of each device is the one to which its history leads.
void check_history(Database& database, Findings& findings) {
  std::string device;
  std::vector<std::int64_t> models;
  std::optional<std::int64_t> current;
  const auto compare = [&] {
    if (device.empty() || (!models.empty() && current == models.back())) return;
    findings.push_back(
        {.place = "device " + device,
         .text = fmt::format(
             "{} is current, but its history leads to {}",
             current ? fmt::format("model {}", *current) : std::string("no model"),
             models.empty() ? std::string("none") : fmt::format("model {}", models.back()))});
  };
  // In one statement, so that no promotion of another program comes in between.
  for (const DatabaseRow& each :
       database.run("SELECT p.device, p.action, p.model, c.model FROM promotions p LEFT JOIN "
                    "current_models c ON c.device = p.device ORDER BY p.device, p.id")) {
    const RowReader row(each);
    if (row.text(0) != device) {
      compare();
      device = row.text(0);
      models.clear();
      current = row.id(3);
    }
    follow(models, row.text(1), row.whole(2));
    if (models.empty() || models.back() != row.whole(2))
      findings.push_back({.place = "device " + device,
                          .text = fmt::format("its history has a roll back to model {}, which was "
                                              "not current before",
                                              row.whole(2))});
  }
  compare();
  for (const DatabaseRow& row : database.run(
           "SELECT device FROM current_models WHERE device NOT IN (SELECT device FROM promotions)"))
    findings.push_back({.place = "device " + RowReader(row).text(0),
                        .text = "it has a current model that was never promoted"});
}

/// Whether the file of a recording is still what was recorded.
void check_recording(const RegisteredRecording& recording, const Progress& progress,
                     Findings& findings) {
  namespace fs = std::filesystem;
  const auto remark = [&](const char* text) {
    findings.push_back({.is_error = false, .place = recording.file, .text = text});
  };
  std::error_code absent;
  if (!fs::path(recording.file).is_absolute())
    return remark("its path is not known, so that it was not compared with its hash");
  if (!fs::is_regular_file(recording.file, absent)) return remark("the recording is not there");
  std::string found;
  try {
    found = sha256_of_file(recording.file, progress);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    found = error.report().problem;
  }
  if (found != recording.sha256)
    findings.push_back(
        {.place = recording.file,
         .text = fmt::format("the recording has changed: expected SHA-256 {}, found {}",
                             recording.sha256, found)});
}

}  // namespace

std::vector<RegistryFinding> Registry::verify(const Progress& progress) {
  std::vector<RegistryFinding> findings;
  std::vector<std::int64_t> models;
  connection_->run([&](Database& database) {
    findings.clear();
    models.clear();
    check_pages(database, address_, findings);
    check_history(database, findings);
    for (const DatabaseRow& row : database.run("SELECT id FROM models ORDER BY id"))
      models.push_back(RowReader(row).whole(0));
  });
  for (std::size_t i = 0; i < models.size(); ++i) {
    report_progress(progress, static_cast<double>(i) / static_cast<double>(models.size()),
                    "checking models");
    connection_->run(
        [&](Database& database) { check_model(database, models[i], address_.name(), findings); });
  }
  for (const RegisteredRecording& recording : recordings())
    check_recording(recording, progress, findings);
  return findings;
}

}  // namespace torsio
