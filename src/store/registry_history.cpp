// The current models of devices, their promotions and their drift.
#include "store/registry_history.hpp"

#include <fmt/format.h>

#include "store/registry_rows.hpp"
#include "store/store_connection.hpp"
#include "torsio/store/registry.hpp"

namespace torsio {
namespace {

constexpr std::string_view kPromotionColumns =
    "p.id, p.device, p.model, p.action, p.made_at, p.made_by, p.reason";
Promotion promotion_from(const RowReader& row) {
  return {.id = row.whole(0),
          .device = row.text(1),
          .model = row.whole(2),
          .is_roll_back = row.text(3) == kRollBack,
          .made_at_s = row.real(4),
          .made_by = row.text(5),
          .reason = row.text(6)};
}

std::vector<Promotion> promotions_of(Database& database, std::string_view serial) {
  std::vector<Promotion> all;
  for (const DatabaseRow& row :
       database.run(fmt::format("SELECT {} FROM promotions p WHERE p.device = $1 ORDER BY p.id",
                                kPromotionColumns),
                    {std::string(serial)}))
    all.push_back(promotion_from(RowReader(row)));
  return all;
}

bool has_request(Database& database, std::string_view table, const std::string& request) {
  return !database.run(fmt::format("SELECT 1 FROM {} WHERE request = $1", table), {request})
              .empty();
}

/// Who changes the current model, and why.
struct Change {
  std::string_view serial;
  std::int64_t model = 0;
  std::string_view action;
  std::string_view by;
  std::string_view reason;
  const std::string& request;
};

void enter(Database& database, const Change& change) {
  const std::string serial(change.serial);
  database.run(fmt::format("INSERT INTO promotions(device, model, action, made_at, made_by, "
                           "reason, request) VALUES($1, $2, $3, {}, $4, $5, $6)",
                           database.now()),
               {serial, change.model, std::string(change.action), std::string(change.by),
                std::string(change.reason), change.request});
  database.run(fmt::format("INSERT INTO current_models(device, model, since) VALUES($1, $2, {}) "
                           "ON CONFLICT(device) DO UPDATE SET model = excluded.model, "
                           "since = excluded.since",
                           database.now()),
               {serial, change.model});
}

}  // namespace

void follow(std::vector<std::int64_t>& models, std::string_view action, std::int64_t model) {
  if (action != kRollBack)
    models.push_back(model);
  else if (!models.empty())
    models.pop_back();
}

bool Registry::promote(std::string_view serial, std::int64_t model, std::string_view by,
                       std::string_view reason) {
  const std::string request = new_request();
  return connection_->run([&](Database& database) {
    Transaction transaction(database, kRegistryLock);
    const std::string place = address_.name();
    // A model that was damaged since it was added must not come into use.
    (void)checked_bytes(database, require_model_of(database, serial, model, place), place);
    if (has_request(database, "promotions", request)) return true;
    if (!database
             .run("SELECT 1 FROM current_models WHERE device = $1 AND model = $2",
                  {std::string(serial), model})
             .empty())
      return false;
    enter(database, {serial, model, kPromote, by, reason, request});
    transaction.commit();
    return true;
  });
}

std::int64_t Registry::roll_back(std::string_view serial, std::string_view by,
                                 std::string_view reason) {
  const std::string request = new_request();
  return connection_->run([&](Database& database) {
    Transaction transaction(database, kRegistryLock);
    const std::string place = address_.name();
    require_device(database, serial, place);
    std::vector<std::int64_t> models;
    for (const Promotion& each : promotions_of(database, serial))
      follow(models, each.is_roll_back ? kRollBack : kPromote, each.model);
    if (has_request(database, "promotions", request)) return models.back();
    if (models.size() < 2)
      throw Error(
          {.place = fmt::format("{}: device {}", place, serial),
           .problem = models.empty()
                          ? "no model was ever promoted, so that none can be rolled back to"
                          : fmt::format("model {} is the first one that was promoted: there "
                                        "is none to roll back to",
                                        models.back()),
           .advice = "Promote the model that is to be used: torsio store promote."});
    const std::int64_t model = models[models.size() - 2];
    (void)checked_bytes(database, find_model(database, model, place), place);
    enter(database, {serial, model, kRollBack, by, reason, request});
    transaction.commit();
    return model;
  });
}

std::optional<RegisteredModel> Registry::current(std::string_view serial) {
  return connection_->run([&](Database& database) -> std::optional<RegisteredModel> {
    require_device(database, serial, address_.name());
    const auto rows =
        database.run(fmt::format("SELECT {} FROM current_models c JOIN models m ON m.id = c.model "
                                 "WHERE c.device = $1",
                                 kModelColumns),
                     {std::string(serial)});
    if (rows.empty()) return std::nullopt;
    return model_from(RowReader(rows.front()));
  });
}

std::vector<Promotion> Registry::promotions(std::string_view serial) {
  return connection_->run([&](Database& database) {
    require_device(database, serial, address_.name());
    return promotions_of(database, serial);
  });
}

void Registry::add_drift(const DriftEntry& entry) {
  const std::string request = new_request();
  connection_->run([&](Database& database) {
    Transaction transaction(database);
    (void)require_model_of(database, entry.device, entry.model, address_.name());
    if (database.run("SELECT 1 FROM recordings WHERE sha256 = $1", {entry.recording}).empty())
      throw Error(
          {.place = address_.name(),
           .problem = fmt::format("the recording {} is not in the registry", entry.recording),
           .advice = "Add the recording first."});
    if (has_request(database, "drift", request)) return;
    const auto number = [](double value) { return number_or_null(value); };
    database.run(
        fmt::format("INSERT INTO drift(device, model, recording, found_at, verdict, rmse, bias, "
                    "stiffness, stiffness_error, friction, friction_error, zero, zero_error, "
                    "temperature_C, details, request) VALUES($1, $2, $3, {}, $4, $5, $6, $7, $8, "
                    "$9, $10, $11, $12, $13, $14, $15)",
                    database.now()),
        {entry.device, entry.model, entry.recording, entry.verdict, number(entry.rmse),
         number(entry.bias), number(entry.stiffness), number(entry.stiffness_error),
         number(entry.friction), number(entry.friction_error), number(entry.zero),
         number(entry.zero_error), number(entry.temperature_degC), entry.details, request});
    transaction.commit();
  });
}

std::vector<DriftEntry> Registry::drift_history(std::string_view serial) {
  return connection_->run([&](Database& database) {
    require_device(database, serial, address_.name());
    std::vector<DriftEntry> all;
    for (const DatabaseRow& row : database.run(
             fmt::format("SELECT {} FROM drift h WHERE h.device = $1 ORDER BY h.id", kDriftColumns),
             {std::string(serial)}))
      all.push_back(drift_from(RowReader(row)));
    return all;
  });
}

std::vector<DeviceSummary> Registry::summaries() {
  return connection_->run([&](Database& database) {
    std::map<std::string, DeviceSummary, std::less<>> found;
    for (const DatabaseRow& each :
         database.run(fmt::format("SELECT {} FROM devices d", kDeviceColumns))) {
      DeviceSummary summary{.device = device_from(RowReader(each))};
      found.emplace(summary.device.serial, std::move(summary));
    }
    for (const DatabaseRow& each : database.run(
             fmt::format("SELECT {}, c.since FROM current_models c JOIN models m ON m.id = c.model",
                         kModelColumns))) {
      const RowReader row(each);
      DeviceSummary& summary = found[row.text(1)];
      summary.current = model_from(row);
      summary.current_since_s = row.real(kModelColumnCount);
    }
    for (const DatabaseRow& each :
         database.run(fmt::format("SELECT {} FROM devices d JOIN drift h ON h.id = (SELECT max(id) "
                                  "FROM drift WHERE device = d.serial)",
                                  kDriftColumns)))
      found[RowReader(each).text(1)].last_drift = drift_from(RowReader(each));
    for (const DatabaseRow& each :
         database.run("SELECT device, count(*) FROM models GROUP BY device"))
      found[RowReader(each).text(0)].models = static_cast<std::size_t>(RowReader(each).whole(1));
    for (const DatabaseRow& each : database.run(
             "SELECT device, count(*) FROM (SELECT device, sha256 FROM recordings WHERE device IS "
             "NOT NULL UNION SELECT m.device, r.recording FROM model_recordings r JOIN models m ON "
             "m.id = r.model) used GROUP BY device"))
      found[RowReader(each).text(0)].recordings =
          static_cast<std::size_t>(RowReader(each).whole(1));
    std::vector<DeviceSummary> all;
    all.reserve(found.size());
    for (auto& [serial, summary] : found) all.push_back(std::move(summary));
    return all;
  });
}

}  // namespace torsio
