#include "store/lost_trials.hpp"

#include <fmt/format.h>

#include <map>
#include <set>

#include "store/row_values.hpp"

namespace torsio {
namespace {

constexpr std::int64_t kMaxLost = 3;  ///< a trial that lost its worker so often has failed

/// What happens to a trial that its worker ran alone, or with others.
std::string loss(bool was_alone) {
  if (!was_alone)
    return fmt::format("lost = CASE WHEN lost <= 0 THEN lost - 1 ELSE lost END, state = {}",
                       number(TrialState::waiting));
  return fmt::format(
      "lost = CASE WHEN lost <= 0 THEN 1 ELSE lost + 1 END, "
      "state = CASE WHEN lost + 1 >= {0} THEN {1} ELSE {2} END, "
      "reason = CASE WHEN lost + 1 >= {0} THEN 'its worker was lost {0} times: it crashed, was "
      "killed or had no memory left' ELSE '' END",
      kMaxLost, number(TrialState::failed), number(TrialState::waiting));
}

}  // namespace

std::vector<std::string> take_back_of(
    Database& database, std::int64_t study,
    const std::function<bool(const std::string& worker)>& is_lost) {
  const auto rows = database.run(
      fmt::format("SELECT id, attempt, worker, key FROM trials WHERE study = $1 AND state = {} "
                  "ORDER BY id",
                  number(TrialState::running)),
      {study});
  // Counted before any of them is locked: another worker may be taking some of them back.
  std::map<std::string, int> trials;
  for (const DatabaseRow& row : rows) ++trials[text(row[2])];
  std::vector<std::string> keys;
  for (const DatabaseRow& row : rows) {
    if (!is_lost(text(row[2]))) continue;
    // Without those that another worker is taking back: if it is stopped meanwhile, others do not wait.
    const auto taken = database.run(
        fmt::format("UPDATE trials SET {} WHERE id IN (SELECT id FROM trials WHERE id = $1 AND "
                    "attempt = $2 AND state = {}{}) RETURNING id",
                    loss(trials[text(row[2])] == 1), number(TrialState::running),
                    database.skip_locked()),
        {whole(row[0]), whole(row[1])});
    if (!taken.empty()) keys.push_back(text(row[3]));
  }
  return keys;
}

void take_back_ended_leases(Database& database, std::int64_t study, const std::string& own) {
  std::set<std::string> lost;
  for (const DatabaseRow& row : database.run(
           fmt::format("SELECT DISTINCT worker FROM trials WHERE study = $1 AND state = {} AND "
                       "lease_until < {} AND worker <> $2",
                       number(TrialState::running), database.now()),
           {study, own}))
    lost.insert(text(row[0]));
  // All trials of such a worker: their leases end one after the other, and the last one would seem
  // to have been alone.
  if (!lost.empty())
    take_back_of(database, study, [&](const std::string& worker) { return lost.contains(worker); });
}

void withdraw_loss(Database& database, std::int64_t trial) {
  database.run(
      fmt::format("UPDATE trials SET lost = CASE WHEN lost > 0 THEN lost - 1 WHEN lost < 0 "
                  "THEN lost + 1 ELSE 0 END WHERE id = $1 AND state IN ({}, {})",
                  number(TrialState::waiting), number(TrialState::running)),
      {trial});
}

}  // namespace torsio
