// Masks, sensors that are slower than the log, and columns that could be the same channel.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "check/draft/column_relations.hpp"
#include "check/draft/draft_steps.hpp"
#include "check/signal_faults.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxMasks = 16;  ///< each is compared with every channel

std::string fresh_name(const std::string& channel) {
  const auto parts = split_channel_name(channel);
  return fmt::format("{}_fresh_1", parts ? parts->quantity : channel);
}

bool is_channel(const ColumnGuess& guess) {
  return guess.is_written() && guess.channel != "t_s" && !guess.channel.ends_with("_fresh_1");
}

/// The channel whose changes the mask marks; it moves in other rows than the others do.
void guess_mask(DraftWork& work, std::size_t mask) {
  ColumnGuess& guess = work.draft.columns[mask];
  std::vector<std::size_t> marked;
  for (std::size_t i = 0; i < work.size(); ++i)
    if (is_channel(work.draft.columns[i]) && work.draft.columns[i].summary.empty == 0 &&
        work.draft.columns[i].summary.fresh > 1 && is_mask_of(work.values(mask), work.values(i)))
      marked.push_back(i);
  const bool is_named = work.readings[mask].quantity == Quantity::mask;
  if (marked.empty()) {
    if (is_named && guess.channel.empty())
      guess.missing = "which channel is new where it is 1: none changes only there";
    return;
  }
  const auto torque = std::ranges::find_if(
      marked, [&](std::size_t i) { return work.draft.columns[i].channel == "torque_Nm"; });
  const std::size_t of = torque != marked.end() ? *torque : marked.front();
  const ColumnGuess& slow = work.draft.columns[of];
  guess.channel = fresh_name(slow.channel);
  guess.unit = guess.summary.unit.empty() ? "1" : guess.summary.unit;
  guess.certainty = Certainty::sure;
  guess.reasons.clear();
  if (is_named) guess.add(Certainty::sure, "name: " + work.readings[mask].word);
  guess.add(marked.size() == 1 ? Certainty::sure : Certainty::likely,
            fmt::format("relation: '{}' changes only where it is 1", slow.summary.name));
}

bool is_better(const ColumnGuess& guess, const ColumnGuess& than) {
  if (guess.is_written() != than.is_written()) return guess.is_written();
  const bool moves = guess.summary.fresh > 1;
  if (moves != (than.summary.fresh > 1)) return moves;
  return guess.certainty > than.certainty;
}

}  // namespace

void guess_held(DraftWork& work) {
  std::size_t masks = 0;
  for (std::size_t i = 0; i < work.size() && masks < kMaxMasks; ++i) {
    if (!is_of_zeros_and_ones(work.values(i)) || work.readings[i].quantity == Quantity::other)
      continue;
    guess_mask(work, i);
    ++masks;
  }
  if (!work.table.has_units) return;  // messages hold their last value
  for (std::size_t i = 0; i < work.size(); ++i) {
    ColumnGuess& guess = work.draft.columns[i];
    const bool has_mask =
        !work.table.columns[i].fresh.empty() || work.draft.of(fresh_name(guess.channel)) != nullptr;
    if (!is_channel(guess) || has_mask) continue;
    if (is_sparse(work.values(i))) {
      guess.holds = true;
      guess.reasons.push_back(fmt::format("values: {} of {} rows are empty: a slower sensor",
                                          guess.summary.empty, work.table.rows()));
    } else if (const std::size_t rows =
                   held_rows({.name = guess.channel, .values = work.values(i)});
               rows > 1) {
      guess.holds = true;
      guess.reasons.push_back(fmt::format("values: held over {} rows: a slower sensor", rows));
    }
  }
}

void settle_torques(DraftWork& work) {
  const std::vector<std::size_t> torques = work.measured(Quantity::torque);
  const auto is_sensor = [&](std::size_t i) { return work.readings[i].is_sensor; };
  const auto sensor = std::ranges::find_if(torques, is_sensor);
  if (sensor == torques.end()) return;
  for (const std::size_t i : torques) {
    ColumnGuess& guess = work.draft.columns[i];
    if (is_sensor(i) || guess.channel != "torque_Nm") continue;
    guess.certainty = Certainty::unsure;
    guess.missing = fmt::format("which torque it is: '{}' is that of a sensor",
                                work.draft.columns[*sensor].summary.name);
  }
}

void settle_twins(DraftWork& work) {
  std::map<std::string, std::size_t> best;
  for (std::size_t i = 0; i < work.size(); ++i) {
    const ColumnGuess& guess = work.draft.columns[i];
    if (guess.channel.empty()) continue;
    const auto [first, is_new] = best.emplace(guess.channel, i);
    if (!is_new && is_better(guess, work.draft.columns[first->second])) first->second = i;
  }
  for (std::size_t i = 0; i < work.size(); ++i) {
    ColumnGuess& guess = work.draft.columns[i];
    if (guess.channel.empty() || best.at(guess.channel) == i) continue;
    ColumnGuess& taken = work.draft.columns[best.at(guess.channel)];
    guess.certainty = Certainty::unsure;
    guess.missing = fmt::format("one of the two: '{}' is taken for it", taken.summary.name);
    const std::string doubt = fmt::format("name: '{}' could be it, too", guess.summary.name);
    if (taken.reasons.empty() || taken.reasons.back().find("could be it") == std::string::npos)
      taken.add(taken.summary.fresh > 1 && guess.summary.fresh <= 1 ? Certainty::likely
                                                                    : Certainty::unsure,
                doubt);
  }
}

}  // namespace torsio
