#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "store/database.hpp"

// A trial whose worker was lost waits again. Whether the trial itself may have been the cause is in its
// column `lost`:
//
//     n > 0   its worker was lost n times while it ran no other trial
//     n < 0   its worker was lost -n times while it ran others, too: any of them may be the cause, or none
//
// A worker that is killed by a person, or by a power cut, must not make a trial fail; one that uses up all memory
// must not kill all workers. So only losses of the first kind count, and a trial that was lost twice among others is
// run by itself from then on, where it is found out.
namespace torsio {

/// The condition for trials that run only in a worker that runs nothing else.
constexpr std::string_view kRunsAlone = "lost NOT IN (0, -1)";
/// The condition for all others.
constexpr std::string_view kRunsWithOthers = "lost IN (0, -1)";

/// Takes back all running trials of the workers for which `is_lost`, in the transaction of the caller.
/// @returns their keys
std::vector<std::string> take_back_of(
    Database& database, std::int64_t study,
    const std::function<bool(const std::string& worker)>& is_lost);

/// The same for workers other than `own` of which a lease has ended.
void take_back_ended_leases(Database& database, std::int64_t study, const std::string& own);

/// A loss was not because of the trial: its worker runs.
void withdraw_loss(Database& database, std::int64_t trial);

}  // namespace torsio
