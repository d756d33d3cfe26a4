#include "torsio/store/study_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "store/database.hpp"
#include "store/lost_trials.hpp"
#include "store/row_values.hpp"
#include "store/store_connection.hpp"

namespace torsio {
namespace {

/// Added to the number of a study: one decision about its halving steps at a time.
constexpr std::int64_t kDecisionLock = 0x746f7273'00000000;

double real(const DatabaseValue& value) {
  if (const auto* const integer = std::get_if<std::int64_t>(&value))
    return static_cast<double>(*integer);
  const auto* const found = std::get_if<double>(&value);
  return found == nullptr ? kNotMeasured : *found;
}
std::string text_or_empty(const DatabaseValue& value) {
  const auto* const found = std::get_if<std::string>(&value);
  return found == nullptr ? std::string() : *found;
}
/// A value that is not finite is NULL: databases sort NaN differently.
DatabaseValue finite_or_null(double value) {
  if (std::isfinite(value)) return value;
  return std::monostate{};
}

constexpr std::string_view kStudyColumns = "id, name, kind, spec, torsio_version";
StoredStudy study_from(const DatabaseRow& row) {
  return {.id = whole(row[0]),
          .name = text(row[1]),
          .kind = text(row[2]),
          .spec = text(row[3]),
          .torsio_version = text(row[4])};
}

constexpr std::string_view kTrialColumns =
    "t.id, t.key, t.spec, t.family, t.device, t.step, t.priority, t.state, t.attempt, t.worker, "
    "t.reason, r.value, r.result, r.seconds";
TrialRecord trial_from(const DatabaseRow& row) {
  TrialRecord record{.id = whole(row[0]),
                     .trial = {.key = text(row[1]),
                               .spec = text(row[2]),
                               .group = text(row[3]),
                               .device = text(row[4]),
                               .step = static_cast<int>(whole(row[5])),
                               .priority = real(row[6])},
                     .state = static_cast<TrialState>(whole(row[7])),
                     .attempt = whole(row[8]),
                     .worker = text(row[9])};
  record.result = {.is_failed = record.state == TrialState::failed,
                   .value = real(row[11]),
                   .reason = text(row[10]),
                   .result = text_or_empty(row[12]),
                   .seconds = real(row[13])};
  return record;
}

std::vector<TrialRecord> records_from(const std::vector<DatabaseRow>& rows) {
  std::vector<TrialRecord> records;
  records.reserve(rows.size());
  for (const DatabaseRow& row : rows) records.push_back(trial_from(row));
  return records;
}

std::optional<StoredStudy> find(Database& database, std::string_view name) {
  const auto rows = database.run(
      fmt::format("SELECT {} FROM studies WHERE name = $1", kStudyColumns), {std::string(name)});
  if (rows.empty()) return std::nullopt;
  return study_from(rows.front());
}

void insert_trials(Database& database, std::int64_t study, std::span<const Trial> trials) {
  std::int64_t added = 0;
  double priority = 0.0;
  std::set<std::pair<std::string, int>> steps;
  for (const Trial& trial : trials) {
    const auto rows = database.run(
        "INSERT INTO trials(study, key, spec, family, device, step, priority) "
        "VALUES($1, $2, $3, $4, $5, $6, $7) ON CONFLICT(study, key, step) DO NOTHING RETURNING id",
        {study, trial.key, trial.spec, trial.group, trial.device, std::int64_t{trial.step},
         trial.priority});
    if (rows.empty()) continue;
    ++added;
    priority += trial.priority;
    if (steps.emplace(trial.group, trial.step).second)
      database.run(
          "INSERT INTO steps(study, family, step) VALUES($1, $2, $3) "
          "ON CONFLICT(study, family, step) DO NOTHING",
          {study, trial.group, std::int64_t{trial.step}});
  }
  database.run(
      "UPDATE studies SET trials = trials + $2, total_priority = total_priority + $3 "
      "WHERE id = $1",
      {study, added, priority});
}

void refuse_another(const StoredStudy& found, const StoredStudy& wanted, const std::string& place) {
  refuse_other_version(found, wanted.torsio_version, place);
  if (found.kind != wanted.kind || found.spec != wanted.spec)
    throw UsageError({.place = place,
                      .problem = fmt::format("study '{}' exists with other recordings, models or "
                                             "options",
                                             wanted.name),
                      .advice =
                          "Repeat the command that began it to continue, or give --study another "
                          "name."});
}

}  // namespace

std::string_view name(TrialState state) noexcept {
  switch (state) {
    case TrialState::waiting: return "waiting";
    case TrialState::running: return "running";
    case TrialState::done: return "done";
    case TrialState::failed: return "failed";
    case TrialState::pruned: return "pruned";
  }
  return "unknown";
}

void refuse_other_version(const StoredStudy& study, std::string_view version,
                          const std::string& place) {
  if (study.torsio_version == version) return;
  throw Error(
      {.place = place,
       .problem = fmt::format("study '{}' was begun by another version of torsio, whose fits may "
                              "differ in the last digits",
                              study.name),
       .expected = study.torsio_version,
       .found = std::string(version),
       .advice = "Use the version that began it, or begin a study with another name."});
}

StudyStore::StudyStore(const StoreAddress& address, OnWait on_wait, double patience_s)
    : address_(address),
      connection_(std::make_unique<StoreConnection>(address, std::move(on_wait), patience_s)) {}
StudyStore::~StudyStore() = default;

template <class Work>
auto StudyStore::with_connection(const Work& work) {
  return connection_->run(work);
}

StoredStudy StudyStore::create_or_resume(const StoredStudy& study, std::span<const Trial> trials) {
  return with_connection([&](Database& database) {
    if (const auto known = find(database, study.name)) {
      refuse_another(*known, study, address_.name());
      return *known;
    }
    Transaction transaction(database, kDecisionLock);
    if (find(database, study.name)) return *find(database, study.name);
    database.run(fmt::format("INSERT INTO studies(name, kind, spec, torsio_version, created_at) "
                             "VALUES($1, $2, $3, $4, {})",
                             database.now()),
                 {study.name, study.kind, study.spec, study.torsio_version});
    StoredStudy made = *find(database, study.name);
    insert_trials(database, made.id, trials);
    transaction.commit();
    return made;
  });
}

std::optional<StoredStudy> StudyStore::find_study(std::string_view name) {
  return with_connection([&](Database& database) { return find(database, name); });
}

std::vector<StoredStudy> StudyStore::studies() {
  return with_connection([&](Database& database) {
    std::vector<StoredStudy> all;
    for (const DatabaseRow& row :
         database.run(fmt::format("SELECT {} FROM studies ORDER BY id", kStudyColumns)))
      all.push_back(study_from(row));
    return all;
  });
}

std::optional<Claim> StudyStore::claim(std::int64_t study, const std::string& worker,
                                       double lease_s, bool runs_nothing) {
  const auto claiming = [](const Database& database, std::string_view condition) {
    return fmt::format(
        "UPDATE trials SET state = {}, attempt = attempt + 1, worker = $2, lease_until = {} + $3 "
        "WHERE id = (SELECT id FROM trials WHERE study = $1 AND state = {} AND {} ORDER BY "
        "priority DESC, id LIMIT 1{}) RETURNING id, attempt, key, spec, family, device, step",
        number(TrialState::running), database.now(), number(TrialState::waiting), condition,
        database.skip_locked());
  };
  return with_connection([&](Database& database) -> std::optional<Claim> {
    Transaction transaction(database);
    // After an outage of the server or of the network others may not have extended theirs yet.
    if (connection_->seconds_since_outage() > lease_s)
      take_back_ended_leases(database, study, worker);
    auto rows = database.run(claiming(database, kRunsWithOthers), {study, worker, lease_s});
    const bool runs_alone = rows.empty() && runs_nothing;
    if (runs_alone) rows = database.run(claiming(database, kRunsAlone), {study, worker, lease_s});
    transaction.commit();
    if (rows.empty()) return std::nullopt;
    const DatabaseRow& row = rows.front();
    return Claim{.trial = whole(row[0]),
                 .study = study,
                 .attempt = whole(row[1]),
                 .key = text(row[2]),
                 .spec = text(row[3]),
                 .group = text(row[4]),
                 .device = text(row[5]),
                 .step = static_cast<int>(whole(row[6])),
                 .runs_alone = runs_alone};
  });
}

bool StudyStore::extend(const Claim& claim, double lease_s) {
  return with_connection([&](Database& database) {
    return !database
                .run(fmt::format("UPDATE trials SET lease_until = {} + $3 WHERE id = $1 AND "
                                 "attempt = $2 AND state = {} RETURNING id",
                                 database.now(), number(TrialState::running)),
                     {claim.trial, claim.attempt, lease_s})
                .empty();
  });
}

bool StudyStore::finish(const Claim& claim, const TrialResult& result) {
  return with_connection([&](Database& database) {
    const TrialState state = result.is_failed ? TrialState::failed : TrialState::done;
    Transaction transaction(database);
    const bool is_mine =
        !database
             .run(fmt::format("UPDATE trials SET state = $3, reason = $4 WHERE id = $1 AND "
                              "attempt = $2 AND state = {} RETURNING id",
                              number(TrialState::running)),
                  {claim.trial, claim.attempt, number(state), result.reason})
             .empty();
    // Repeated after a commit whose answer was lost: the result of this attempt is there.
    if (!is_mine)
      return !database
                  .run("SELECT 1 FROM results WHERE trial = $1 AND attempt = $2",
                       {claim.trial, claim.attempt})
                  .empty();
    database.run(
        fmt::format("INSERT INTO results VALUES($1, $2, $3, $4, $5, $6, {})", database.now()),
        {claim.trial, claim.study, claim.attempt, finite_or_null(result.value), result.result,
         result.seconds});
    if (!result.samples.empty())
      database.run("INSERT INTO samples VALUES($1, $2)", {claim.trial, Blob{result.samples}});
    transaction.commit();
    return true;
  });
}

void StudyStore::give_back(const Claim& claim) {
  with_connection([&](Database& database) {
    database.run(fmt::format("UPDATE trials SET state = {} WHERE id = $1 AND attempt = $2 AND "
                             "state = {}",
                             number(TrialState::waiting), number(TrialState::running)),
                 {claim.trial, claim.attempt});
  });
}

void StudyStore::withdraw_loss(const Claim& claim) {
  with_connection([&](Database& database) { torsio::withdraw_loss(database, claim.trial); });
}

std::vector<std::string> StudyStore::take_back(
    std::int64_t study, const std::function<bool(const std::string& worker)>& is_dead) {
  return with_connection([&](Database& database) {
    Transaction transaction(database);
    std::vector<std::string> keys = take_back_of(database, study, is_dead);
    transaction.commit();
    return keys;
  });
}

bool StudyStore::advance(
    std::int64_t study,
    const std::function<HalvingDecision(const std::string& group, int step,
                                        std::span<const TrialRecord>)>& decide) {
  // A group's step without an unfinished trial and without a decision. It is asked after each trial:
  // its cost does not grow with the number of trials. The question without a lock first.
  constexpr std::string_view kOpen =
      "SELECT s.family, s.step FROM steps s WHERE s.study = $1 AND s.is_decided = 0 "
      "AND NOT EXISTS(SELECT 1 FROM trials u WHERE u.study = s.study AND u.family = s.family AND "
      "u.step = s.step AND u.state < 2) ORDER BY s.family, s.step";
  return with_connection([&](Database& database) {
    if (database.run(kOpen, {study}).empty()) return false;
    Transaction transaction(database, kDecisionLock + study);
    const auto open = database.run(kOpen, {study});
    for (const DatabaseRow& row : open) {
      const std::string& group = text(row[0]);
      const auto records = records_from(database.run(
          fmt::format("SELECT {} FROM trials t LEFT JOIN results r ON r.trial = t.id WHERE "
                      "t.study = $1 AND t.family = $2 AND t.step = $3 ORDER BY t.id",
                      kTrialColumns),
          {study, group, whole(row[1])}));
      const HalvingDecision decision = decide(group, static_cast<int>(whole(row[1])), records);
      for (const HalvingDecision::Pruned& pruned : decision.pruned)
        database.run("UPDATE trials SET state = $2, reason = $3 WHERE id = $1",
                     {pruned.trial, number(TrialState::pruned), pruned.reason});
      insert_trials(database, study, decision.next);
      database.run("UPDATE steps SET is_decided = 1 WHERE study = $1 AND family = $2 AND step = $3",
                   {study, group, whole(row[1])});
    }
    transaction.commit();
    return !open.empty();
  });
}

StudyCounts StudyStore::counts(std::int64_t study) {
  return with_connection([&](Database& database) {
    StudyCounts counts;
    const auto all =
        database.run("SELECT trials, total_priority FROM studies WHERE id = $1", {study});
    if (all.empty()) return counts;
    counts.finished = static_cast<std::size_t>(whole(all.front()[0]));
    counts.total_priority = real(all.front()[1]);
    counts.finished_priority = counts.total_priority;
    for (const DatabaseRow& row :
         database.run("SELECT state, count(*), sum(priority) FROM trials WHERE study = $1 AND "
                      "state < 2 GROUP BY state",
                      {study})) {
      const auto count = static_cast<std::size_t>(whole(row[1]));
      (whole(row[0]) == number(TrialState::running) ? counts.running : counts.waiting) = count;
      counts.finished -= count;
      counts.finished_priority -= real(row[2]);
    }
    return counts;
  });
}

std::vector<TrialRecord> StudyStore::trials(std::int64_t study) {
  return with_connection([&](Database& database) {
    return records_from(database.run(
        fmt::format("SELECT {} FROM trials t LEFT JOIN results r ON r.trial = t.id WHERE "
                    "t.study = $1 ORDER BY t.id",
                    kTrialColumns),
        {study}));
  });
}

std::vector<TrialRecord> StudyStore::best(std::int64_t study, std::size_t count,
                                          const TrialRecord* after) {
  const double value =
      after == nullptr ? -std::numeric_limits<double>::infinity() : after->result.value;
  const std::int64_t trial = after == nullptr ? 0 : after->id;
  return with_connection([&](Database& database) {
    return records_from(database.run(
        fmt::format("SELECT {} FROM results r JOIN trials t ON t.id = r.trial WHERE r.study = $1 "
                    "AND (r.value, r.trial) > ($3, $4) ORDER BY r.value, r.trial LIMIT $2",
                    kTrialColumns),
        {study, static_cast<std::int64_t>(count), value, trial}));
  });
}

std::vector<TrialRecord> StudyStore::history(std::string_view device) {
  return with_connection([&](Database& database) {
    return records_from(database.run(
        fmt::format("SELECT {} FROM trials t LEFT JOIN results r ON r.trial = t.id WHERE "
                    "t.device = $1 AND t.device <> '' ORDER BY t.id",
                    kTrialColumns),
        {std::string(device)}));
  });
}

std::string StudyStore::samples(std::int64_t trial) {
  return with_connection([&](Database& database) {
    const auto rows = database.run("SELECT bytes FROM samples WHERE trial = $1", {trial});
    return rows.empty() ? std::string() : std::get<Blob>(rows.front().front()).bytes;
  });
}

}  // namespace torsio
