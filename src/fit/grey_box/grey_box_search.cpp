#include "fit/grey_box/grey_box_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/report_progress.hpp"
#include "numerics/parallel.hpp"

namespace torsio {
namespace {

constexpr double kWorthwhile = 0.99;
/// For one or two recordings. Blocks resemble their neighbours: what gains less on them seldom gains on
/// another motion.
constexpr double kWorthwhileOfFew = 0.95;
/// All banks together.
constexpr double kTogether = 0.9;
constexpr double kTogetherOfFew = 0.8;
/// Thresholds that are chosen one by one, beside an even spread of them.
constexpr double kThresholdsTogether = 0.5;

/// None, the second finest threshold, which is above the resolution and below any loop, and 2, 4 and 8 that are spread
/// evenly.
constexpr std::array<std::uint32_t, 5> kSpreads{0, 0b10, 0b00010001, 0b01010101, 0b11111111};

/// The next spreads up to two places further, or one place back.
std::vector<std::uint32_t> other_spreads(std::uint32_t at) {
  const auto place = static_cast<std::size_t>(std::ranges::find(kSpreads, at) - kSpreads.begin());
  std::vector<std::uint32_t> others;
  for (std::size_t to = place + 1; to <= place + 2 && to < kSpreads.size(); ++to)
    others.push_back(kSpreads.at(to));
  if (place > 1) others.push_back(kSpreads.at(place - 1));
  return others;
}

/// One slip element more, one less, or one with another threshold.
std::vector<std::uint32_t> other_thresholds(std::uint32_t at) {
  std::vector<std::uint32_t> others;
  for (std::size_t i = 0; i < GreyBoxSums::kThresholds; ++i) {
    const std::uint32_t one = at ^ (1U << i);
    if (one != 0) others.push_back(one);
    for (std::size_t j = 0; j < i; ++j)
      if ((at >> i & 1U) != (at >> j & 1U)) others.push_back(one ^ (1U << j));
  }
  return others;
}

/// A function that adds to `next` what a change makes of `at`.
template <class Choice>
auto adding_changed(const Choice& at, std::vector<Choice>& next) {
  return [&at, &next](auto change) { change(next.emplace_back(at)); };
}

/// One step up any sequence from `at`.
/// @param others thresholds of the slip elements: `other_spreads` or `other_thresholds`
std::vector<GreyBoxChoice> steps_up(const GreyBoxChoice& at, bool has_rates,
                                    GreyBoxSearch::OtherSlips* others) {
  std::vector<GreyBoxChoice> next;
  const auto with = adding_changed(at, next);
  // Two at a time as well: three knots show nothing of a curve that stiffens both ways alike.
  for (std::size_t by = 1; by <= 2; ++by) {
    if (at.curve + by <= GreyBoxSums::kFinest) with([by](auto& c) { c.curve += by; });
  }
  for (const std::uint32_t slips : others(at.slips)) with([slips](auto& c) { c.slips = slips; });
  if (at.slips > 0 && at.forces < GreyBoxSums::kFinest) with([](auto& c) { ++c.forces; });
  if (at.branches < GreyBoxChoice::kMaxBranches) with([](auto& c) { ++c.branches; });
  if (at.smoothing > 0) with([](auto& c) { --c.smoothing; });
  if (!at.is_passive && !at.is_signed && at.slips > 0) with([](auto& c) { c.is_signed = true; });
  // Friction of the wrong sign somewhere: no force >= 0 is a step towards it.
  if (!at.is_passive && at.slips == 0)
    with([](auto& c) {
      c.is_signed = true;
      c.slips = kSpreads[1];
      c.forces = 2;
    });
  if (!at.is_passive && at.slips > 0 && at.forces + 1 < GreyBoxSums::kFinest)
    with([](auto& c) {
      c.is_signed = true;
      c.forces += 2;
      c.curve = std::max(c.curve, c.forces);
    });
  if (has_rates && !at.has_viscous) with([](auto& c) { c.has_viscous = true; });
  if (has_rates && !at.has_coulomb) with([](auto& c) { c.has_coulomb = true; });
  return next;
}

/// One step down any sequence, also two of the knots. Fewer thresholds are among the steps up.
std::vector<GreyBoxChoice> steps_down(const GreyBoxChoice& at) {
  std::vector<GreyBoxChoice> next;
  const auto with = adding_changed(at, next);
  for (std::size_t by = 1; by <= 2; ++by) {
    if (at.curve >= by) with([by](auto& c) { c.curve -= by; });
    if (at.forces >= by) with([by](auto& c) { c.forces -= by; });
  }
  if (at.branches > 0) with([](auto& c) { --c.branches; });
  if (at.smoothing < GreyBoxChoice{}.smoothing) with([](auto& c) { ++c.smoothing; });
  if (at.is_signed) with([](auto& c) { c.is_signed = false; });
  if (at.has_viscous) with([](auto& c) { c.has_viscous = false; });
  if (at.has_coulomb) with([](auto& c) { c.has_coulomb = false; });
  return next;
}

std::vector<GreyBoxChoice> steps(const GreyBoxChoice& at, bool has_rates,
                                 GreyBoxSearch::OtherSlips* others) {
  std::vector<GreyBoxChoice> next = steps_up(at, has_rates, others);
  for (GreyBoxChoice& down : steps_down(at)) next.push_back(std::move(down));
  return next;
}

/// One step up any sequence of one bank.
std::vector<BankChoice> steps_up(const BankChoice& at, bool may_slip) {
  std::vector<BankChoice> next;
  const auto with = adding_changed(at, next);
  for (std::size_t by = 1; by <= 2; ++by) {
    if (at.slips == 0 && may_slip) {
      // Which way the torque acts on this input is not known.
      for (const bool is_negative : {false, true})
        with([&](auto& c) {
          c.slips = by;
          c.is_negative = is_negative;
        });
    } else if (may_slip) {
      if (at.slips + by <= BankChoice::kMaxSlips) with([by](auto& c) { c.slips += by; });
      if (at.forces + by <= BankChoice::kMaxForces) with([by](auto& c) { c.forces += by; });
    }
    if (at.curve + by <= BankChoice::kMaxCurve) with([by](auto& c) { c.curve += by; });
    if (at.product + by <= BankChoice::kMaxProduct) with([by](auto& c) { c.product += by; });
    if (at.relaxations + by <= BankChoice::kMaxRelaxations)
      with([by](auto& c) { c.relaxations += by; });
  }
  return next;
}

}  // namespace

GreyBoxSearch::Candidate GreyBoxSearch::rated(const GreyBoxChoice& choice) const {
  const GreyBoxCandidate::HeldOut error = GreyBoxCandidate(sums_, choice).held_out();
  const bool has_banks = sums_.is_main_chosen || sums_.are_banks_chosen;
  return {.choice = choice,
          .held_out_error = error.rmse,
          .score = has_banks ? error.geometric : error.rmse};
}

std::vector<GreyBoxSearch::Candidate> GreyBoxSearch::rated(
    std::vector<GreyBoxChoice> choices) const {
  std::erase_if(choices,
                [&](const GreyBoxChoice& c) { return !GreyBoxCandidate(sums_, c).is_possible(); });
  std::vector<Candidate> candidates(choices.size());
  for_each_chunk(choices.size(), 0, [&](std::size_t i) {
    candidates[i] = rated(choices[i]);
    // A search of active sets that cycles has no result: it is never the lowest.
    if (std::isnan(candidates[i].score))
      candidates[i].score = std::numeric_limits<double>::infinity();
  });
  return candidates;
}

template <class Next>
GreyBoxSearch::Candidate GreyBoxSearch::climbed(Candidate best, double worthwhile, const Next& next,
                                                const Progress& progress) const {
  constexpr double kUsualSteps = 12.0;
  for (double step = 0.0;; ++step) {
    report_progress(progress, std::min(step / kUsualSteps, 0.99),
                    fmt::format("choosing terms, error {:.4g}", best.held_out_error));
    std::vector<Candidate> candidates = rated(next(best.choice));
    const auto better = std::ranges::min_element(candidates, {}, &Candidate::score);
    if (better == candidates.end() || !(better->score < worthwhile * best.score)) return best;
    best = std::move(*better);
  }
}

GreyBoxSearch::Candidate GreyBoxSearch::choose_banks(const GreyBoxChoice& main,
                                                     const Progress& progress) const {
  GreyBoxChoice without = main;
  without.banks.assign(sums_.all.banks.size(), {});
  const auto next = [this](const GreyBoxChoice& at) {
    std::vector<GreyBoxChoice> choices;
    for (std::size_t k = 0; k < at.banks.size(); ++k) {
      for (const BankChoice& bank : steps_up(at.banks[k], !sums_.all.banks[k].thresholds.empty())) {
        choices.push_back(at);
        choices.back().banks[k] = bank;
      }
    }
    return choices;
  };
  // Two records in turn are hardly more evidence for another motion than blocks of one.
  const bool is_weak = sums_.folds > 1 && sums_.records <= 2;
  const Candidate start = rated(without);
  const Candidate chosen = climbed(start, is_weak ? kWorthwhileOfFew : kWorthwhile, next, progress);
  return chosen.score < (is_weak ? kTogetherOfFew : kTogether) * start.score ? chosen : start;
}

GreyBoxSearch::Candidate GreyBoxSearch::choose(bool passive, const Progress& progress) const {
  return choose(GreyBoxChoice{.is_passive = passive}, progress);
}

GreyBoxSearch::Candidate GreyBoxSearch::choose(const GreyBoxChoice& line,
                                               const Progress& progress) const {
  return climbed(line, other_spreads, progress);
}

GreyBoxSearch::Candidate GreyBoxSearch::climbed(const GreyBoxChoice& line, OtherSlips* others,
                                                const Progress& progress) const {
  // Two or three records seldom determine which of many structures describes another motion: with further steps the
  // errors there rose as often as they fell.
  const auto next = [&](const GreyBoxChoice& at) {
    return sums_.is_by_record ? steps_up(at, has_rates(), others) : steps(at, has_rates(), others);
  };
  return climbed(rated(line), kWorthwhile, next, progress);
}

GreyBoxSearch::Candidate GreyBoxSearch::choose_thresholds(const Candidate& spread,
                                                          const Progress& progress) const {
  const Candidate chosen =
      climbed({.is_passive = spread.choice.is_passive}, other_thresholds, progress);
  return chosen.score < kThresholdsTogether * spread.score ? chosen : spread;
}

bool GreyBoxSearch::has_rates() const {
  return std::ranges::find(sums_.is_rate, 1) != sums_.is_rate.end();
}

std::vector<GreyBoxSearch::Candidate> GreyBoxSearch::neighbours(const GreyBoxChoice& at) const {
  const bool is_spread = std::ranges::find(kSpreads, at.slips) != kSpreads.end();
  return rated(steps(at, has_rates(), is_spread ? other_spreads : other_thresholds));
}

const char* GreyBoxSearch::what_was_held_out() const {
  if (sums_.folds == 1) return "inner knots of the schedule, one at a time";
  return sums_.is_by_record ? "records in turn" : "fifths of interleaved blocks";
}

std::string GreyBoxSearch::description_of(const GreyBoxChoice& choice,
                                          const TrainingData& data) const {
  const GreyBoxTerms::Structure own = GreyBoxCandidate(sums_, choice).structure();
  std::string text = fmt::format("a curve of {} knots", own.curve_knots.size());
  if (!own.thresholds.empty())
    text += fmt::format(", {} slip elements{}", own.thresholds.size(),
                        own.friction_knots.size() == 1
                            ? std::string(" of constant force")
                            : fmt::format(" with forces at {} knots", own.friction_knots.size()));
  if (!own.time_constants_s.empty())
    text += fmt::format(", {} relaxing branches", own.time_constants_s.size());
  if (choice.is_signed) text += ", slip forces of any sign (not passive)";
  if (choice.has_viscous) text += ", viscous friction";
  if (choice.has_coulomb) text += ", dry friction of the rates";
  auto bank = own.banks.begin();
  for (const BankChoice& each : choice.banks)
    if (!each.is_empty()) text += ", " + torsio::description_of(*bank++, each, data);
  return text;
}

}  // namespace torsio
