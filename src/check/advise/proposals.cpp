#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "check/advise/adviser.hpp"
#include "check/signal_pair.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxHalved = 12;  // regions with a learning curve of their own
constexpr double kClearGain = 0.05;
constexpr std::size_t kMaxMotions = 4;
constexpr std::size_t kMaxProposals = 5;
constexpr double kCycles = 12.0;
constexpr double kShortest_s = 20.0;
constexpr double kLongest_s = 300.0;
constexpr double kLongHold_s = 5.0;
constexpr double kManyTimes = 3.0;
constexpr double kRecordingsDiffer = 2.0;  // ratio of squared errors

std::string percent(double share) { return fmt::format("{:.0f} %", 100.0 * share); }

}  // namespace

double Adviser::duration_of(const TriangleMotion& motion) {
  return rounded(std::clamp(kCycles / motion.frequency_Hz, kShortest_s, kLongest_s));
}

void Adviser::propose_motions(const RegionErrors& errors, const ExpectedError& expected) {
  if (use_.empty()) {
    undetermined(
        fmt::format("the missing motion: every motion of the intended use is faster than "
                    "{:.2g} {}/s, or too small. State another --want speed, frequency "
                    "or input",
                    speed_limit_, x_unit_));
    return;
  }
  std::map<RegionKey, double> decreases;
  for (const auto& [key, index] : region_index_)  // the first ones have most of the error
    if (index < kMaxHalved && expected.covered().contains(key) && use_.contains(key))
      decreases[key] = errors.decrease(key);
  ExpectedError::Covered covered = expected.covered();
  std::set<RegionKey> known;
  for (const auto& [key, weight] : use_)
    if (expected.at(key, covered).is_known) known.insert(key);
  advice_.wanted_rmse = std::sqrt(mean_square_of_use(expected, covered, &known));
  std::set<RegionKey> proposed;
  for (std::size_t count = 0; count < kMaxMotions; ++count) {
    const double before = mean_square_of_use(expected, covered);
    double least = before;
    std::optional<RegionKey> best;
    ExpectedError::Covered best_covered;
    for (const auto& [key, weight] : use_) {
      if (proposed.contains(key)) continue;
      ExpectedError::Covered after = covered;
      after[key] = expected.at(key, covered).afterwards - gain_of_more(key, decreases);
      if (const double then = mean_square_of_use(expected, after); then < least)
        least = then, best = key, best_covered = std::move(after);
    }
    const double reduction = best ? 1.0 - std::sqrt(least / before) : 0.0;
    if (reduction < kWorthMentioning) break;
    add_motion(errors, expected, *best, covered);
    Proposal& proposal = advice_.proposals.back();
    proposal.assumed_reduction = reduction;
    if (known.contains(*best))
      proposal.expected_reduction =
          1.0 - std::sqrt(mean_square_of_use(expected, best_covered, &known) /
                          mean_square_of_use(expected, covered, &known));
    proposed.insert(*best);
    covered = std::move(best_covered);
  }
}

double Adviser::gain_of_more(const RegionKey& key,
                             const std::map<RegionKey, double>& decreases) const {
  const auto at = decreases.find(key);
  if (at == decreases.end()) return 0.0;
  const TriangleMotion motion = realisable(key);
  const double more = 2.0 * motion.frequency_Hz * duration_of(motion);
  return at->second * more / (more + static_cast<double>(region_of(key).strokes));
}

std::string Adviser::motion_text(const TriangleMotion& motion, double duration_s) const {
  std::string text = fmt::format("triangles of +-{:.2g} {}", motion.amplitude, x_unit_);
  if (std::abs(motion.centre) > 0.05 * motion.amplitude)
    text += fmt::format(" about {:.2g} {}", motion.centre, x_unit_);
  if (slope_ != 0.0)
    text += fmt::format(" (about +-{:.2g} {})", std::abs(slope_) * motion.amplitude, y_unit_);
  text += fmt::format(" at {:.2g} Hz, that is {:.2g} {}/s, for {:.0f} s", motion.frequency_Hz,
                      motion.speed(), x_unit_, duration_s);
  return text;
}

TriangleMotion Adviser::settable(const RegionKey& key) const {
  TriangleMotion motion = realisable(key);
  if (key.amplitude > 0) motion.amplitude = rounded(motion.amplitude);
  motion.centre = rounded(motion.centre);
  if (std::abs(motion.centre) < 0.05 * grid_.half_range) motion.centre = 0.0;
  motion.frequency_Hz = rounded(motion.frequency_Hz);
  return motion;
}

void Adviser::add_motion(const RegionErrors& errors, const ExpectedError& expected,
                         const RegionKey& key, const ExpectedError::Covered& covered) {
  const TriangleMotion motion = settable(key);
  const double duration_s = duration_of(motion);
  std::string reason;
  if (expected.covered().contains(key)) {
    const Region& region = region_of(key);
    reason = fmt::format(
        "this region has {} of the samples and {} of the squared error of the held-out folds "
        "({:.3g} {} over {} strokes), and the error rises when half of its strokes are left out",
        percent(region.sample_share), percent(region.error_share), region.held_out_rmse, y_unit_,
        region.strokes);
  } else {
    const ExpectedError::Value now = expected.at(key, covered);
    const auto found = errors.held_out().find(key);
    const std::size_t strokes = found == errors.held_out().end() ? 0 : found->second.strokes;
    reason = fmt::format("{} of the recorded strokes are of this kind; ",
                         strokes == 0 ? "none" : std::to_string(strokes));
    reason += fmt::format("{}", fmt::join(expected.growth_texts(now.nearest, key), "; "));
  }
  advice_.proposals.push_back({.recording = motion_text(motion, duration_s),
                               .reason = std::move(reason),
                               .motion = motion,
                               .duration_s = duration_s});
}

void Adviser::propose_conditions(const RegionErrors& errors) {
  for (const ConditionValues& condition : conditions_) {
    ConditionAdvice found = advise_on_condition(condition, wanted(condition.name), errors);
    for (Proposal& proposal : found.proposals) {
      proposal.duration_s = rounded(recorded_s() / static_cast<double>(data_.sequences.size()));
      advice_.proposals.push_back(std::move(proposal));
    }
    for (std::string& text : found.undetermined) undetermined(std::move(text));
  }
  for (const WantedRange& range : wanted_) {
    const bool is_motion =
        range.quantity == "input" || range.quantity == "frequency" || range.quantity == "speed";
    if (!is_motion &&
        std::ranges::find(conditions_, range.quantity, &ConditionValues::name) == conditions_.end())
      undetermined(
          fmt::format("{}: not every training recording has it. List it under "
                      "conditions: in a manifest",
                      range.quantity));
  }
}

double Adviser::recorded_s() const {
  double seconds = 0.0;
  for (const Sequence& sequence : data_.sequences)
    seconds += static_cast<double>(sequence.target.size()) / data_.sample_rate_Hz;
  return seconds;
}

void Adviser::learning_curve(const RegionErrors& errors) {
  advice_.learning_curve = errors.learning_curve();
  const double share = errors.decrease_of_all();  // b over E(n)
  if (!std::isfinite(share)) {
    undetermined(
        "whether more of the same motion helps: a learning curve needs at least 16 "
        "strokes");
    return;
  }
  advice_.same_again_reduction = 1.0 - std::sqrt(1.0 - 0.5 * share);
  // As long as the first proposal, for a fair comparison.
  const double first_s =
      advice_.proposals.empty() ? recorded_s() : advice_.proposals.front().duration_s;
  const double reduction = 1.0 - std::sqrt(1.0 - share * first_s / (first_s + recorded_s()));
  if (reduction >= kWorthMentioning)
    advice_.proposals.push_back(
        {.recording = fmt::format("the same motions again, for {:.0f} s", rounded(first_s)),
         .reason = fmt::format("with half of every region in the training the RMSE is larger, "
                               "so that the amount of data limits it: twice as much lowers it "
                               "by {}",
                               percent(advice_.same_again_reduction)),
         .motion = std::nullopt,
         .duration_s = rounded(first_s),
         .expected_reduction = reduction,
         .assumed_reduction = reduction});
}

void Adviser::find_limits(const RegionErrors& errors) {
  const ErrorRatio between = errors.between_recordings();
  if (between.strokes > 0) advice_.between_recordings = between.ratio;
  if (between.is_clear && between.ratio > kRecordingsDiffer)
    advice_.limits.push_back(fmt::format(
        "the recordings differ at equal motion: on a recording that is left out the RMSE is "
        "{:.2g} times that with a part of it in the training. A quantity that is not among the "
        "inputs changes between them (temperature, mounting, a zero): record the same motion "
        "several times, note what differs as a condition, and take the zero of each",
        std::sqrt(between.ratio)));
  const double rmse = std::sqrt(errors.all_held_out().mean_square());
  if (!std::isfinite(advice_.same_again_reduction) || !std::isfinite(advice_.target_noise)) return;
  if (advice_.same_again_reduction >= kClearGain) return;
  if (rmse > kManyTimes * advice_.target_noise)
    advice_.limits.push_back(fmt::format(
        "the held-out error in the recorded regions ({:.3g} {}) is {:.2g} times the noise of {} "
        "and does not fall with more data: there the model or a missing input limits it, not "
        "the amount of data. Try a family with more structure (torsio compare)",
        rmse, y_unit_, rmse / advice_.target_noise, advice_.target));
  else
    advice_.limits.push_back(fmt::format(
        "the held-out error in the recorded regions ({:.3g} {}) is near the noise of {} ({:.3g} "
        "{}): a better sensor would lower it, more data would not",
        rmse, y_unit_, advice_.target, advice_.target_noise, y_unit_));
}

void Adviser::report_undetermined() {
  if (data_.sequences.size() < 2)
    undetermined(
        "differences between recordings (mounting, day, temperature): there is only "
        "one. Record the same motion once more on another day");
  else if (!std::isfinite(advice_.between_recordings))
    undetermined(
        "differences between recordings: no two of them have the same motion. Repeat "
        "one of them");
  if (wanted("frequency") == nullptr && lowest_Hz_ > 0.0 &&
      RegionGrid::frequency_level(lowest_Hz_ * 1.01) ==
          RegionGrid::frequency_level(highest_Hz_ * 0.99))
    undetermined(fmt::format(
        "the effect of the frequency: all strokes are of {:.2g} to {:.2g} Hz. Record the same "
        "amplitude three times as fast or as slow; --want frequency=... states what is needed",
        lowest_Hz_, highest_Hz_));
  double longest = 0.0;
  for (const auto& strokes : strokes_)
    for (const Stroke& stroke : strokes) longest = std::max(longest, stroke.hold_s);
  if (longest < kLongHold_s)
    undetermined(
        fmt::format("creep and relaxation: the longest rest is {:.2g} s. Hold +-{:.2g} "
                    "{} for a minute each",
                    longest, 0.8 * grid_.half_range, x_unit_));
  for (std::size_t j = 1; j < data_.input_count(); ++j) {
    Extent range;
    for (const Sequence& sequence : data_.sequences)
      for (std::size_t n = 0; n < sequence.target.size(); ++n)
        if (sequence.use[n] != 0) range.include(sequence.features(n, j));
    if (!(range.width() > 0.0))
      undetermined(fmt::format("the effect of {}: it is {:g} in every recording",
                               data_.inputs[j].expression, range.lowest));
  }
  if (conditions_.empty())
    undetermined(
        "the effect of temperature, load or any other condition: the recordings state "
        "none. A manifest gives them (conditions:)");
}

void Adviser::rank() {
  std::ranges::stable_sort(advice_.proposals, std::greater(), &Proposal::assumed_reduction);
  if (advice_.proposals.size() > kMaxProposals)
    advice_.proposals.erase(advice_.proposals.begin() + static_cast<std::ptrdiff_t>(kMaxProposals),
                            advice_.proposals.end());
}

}  // namespace torsio
