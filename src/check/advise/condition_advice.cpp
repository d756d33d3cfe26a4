#include "check/advise/condition_advice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "torsio/core/units.hpp"

namespace torsio {
namespace {

// Assumed share of the RMSE for a hole over the whole range, if nothing determines it.
constexpr double kUnknownGain = 0.2;
constexpr double kMaxLogRatio = 6.0;
constexpr double kSlack = 1e-9;

/// Part of the wanted range without a recording.
struct Hole {
  double lowest = 0.0;
  double highest = 0.0;
  bool is_beyond = false;  ///< beyond the recorded values, not between two

  [[nodiscard]] double width() const { return highest - lowest; }
};

/// ln of the ratio of squared errors, per share of the recorded range that a hole is wide.
struct GrowthOfHoles {
  double per_range = 0.0;
  double rmse_ratio = 1.0;  ///< the largest that was found
  std::size_t values = 0;   ///< left out
};

}  // namespace

std::vector<ConditionValues> conditions_of(const Dataset& dataset) {
  std::vector<ConditionValues> conditions;
  bool is_first = true;
  for (const DatasetRecord& record : dataset.records) {
    if (!record.has_role(Role::train)) continue;
    if (is_first)
      for (const std::string& name : record.recording.conditions())
        conditions.push_back({.name = name, .of_recording = {}});
    is_first = false;
    std::erase_if(conditions, [&](const ConditionValues& condition) {
      return std::ranges::find(record.recording.conditions(), condition.name) ==
             record.recording.conditions().end();
    });
    for (ConditionValues& condition : conditions)
      condition.of_recording.push_back(record.recording.channel(condition.name).values.front());
  }
  return conditions;
}

ConditionAdvice advise_on_condition(const ConditionValues& condition, const WantedRange* wanted,
                                    const RegionErrors& errors) {
  ConditionAdvice advice;
  const std::set<double> known(condition.of_recording.begin(), condition.of_recording.end());
  const std::vector<double> values(known.begin(), known.end());
  const double lowest = values.front();
  const double highest = values.back();
  const std::string unit = unit_label(condition.name);
  if (values.size() < 2) {
    advice.undetermined.push_back(
        fmt::format("the effect of {}: it is {:g} {} in every recording. Record the same motion at "
                    "another value",
                    condition.name, lowest, unit));
    return advice;
  }
  const double range = highest - lowest;
  const auto without = [&](double value) {
    std::vector<std::uint8_t> is_left_out;
    for (const double each : condition.of_recording) is_left_out.push_back(each == value ? 1 : 0);
    return errors.without_recordings(is_left_out);
  };
  GrowthOfHoles between;
  GrowthOfHoles beyond;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool is_end = i == 0 || i + 1 == values.size();
    const double width = is_end ? (i == 0 ? values[1] - values[0] : values[i] - values[i - 1])
                                : values[i + 1] - values[i - 1];
    const ErrorRatio ratio = without(values[i]);
    if (ratio.strokes == 0) continue;
    GrowthOfHoles& growth = is_end ? beyond : between;
    if (ratio.is_clear) growth.per_range += std::log(ratio.ratio) * range / width;
    growth.rmse_ratio = std::max(growth.rmse_ratio, std::sqrt(ratio.ratio));
    ++growth.values;
  }
  for (GrowthOfHoles* growth : {&between, &beyond})
    if (growth->values > 0) growth->per_range /= static_cast<double>(growth->values);

  const double from = wanted != nullptr ? wanted->lowest : lowest;
  const double to = wanted != nullptr ? wanted->highest : highest;
  std::vector<Hole> holes;
  if (from < lowest - kSlack * range) holes.push_back({from, lowest, true});
  for (std::size_t i = 1; i < values.size(); ++i)
    if (values[i] > from && values[i - 1] < to) holes.push_back({values[i - 1], values[i]});
  if (to > highest + kSlack * range) holes.push_back({highest, to, true});
  // Mean over the wanted range of the squared error over that at a recorded value: the growth is
  // highest in the middle of a hole, or at its end if that is open.
  const auto mean_growth = [&](const Hole& hole) {
    const GrowthOfHoles& growth = hole.is_beyond ? beyond : between;
    const double most = std::min(growth.per_range * hole.width() / range, kMaxLogRatio);
    return 0.5 * (1.0 + std::exp(most));
  };
  double total = 0.0;
  double weights = 0.0;
  for (const Hole& hole : holes) total += hole.width() * mean_growth(hole), weights += hole.width();
  for (const Hole& hole : holes) {
    const GrowthOfHoles& growth = hole.is_beyond ? beyond : between;
    const double value = !hole.is_beyond        ? 0.5 * (hole.lowest + hole.highest)
                         : hole.lowest < lowest ? hole.lowest
                                                : hole.highest;
    const Hole half{hole.lowest, 0.5 * (hole.lowest + hole.highest), hole.is_beyond};
    const double after = total - hole.width() * (mean_growth(hole) - mean_growth(half));
    Proposal proposal{.recording = fmt::format("the motions of the recordings at {} = {:.3g} {}",
                                               condition.name, value, unit),
                      .reason = {},
                      .motion = {},
                      .condition = condition.name,
                      .condition_value = value};
    if (growth.values == 0) {
      proposal.reason = fmt::format(
          "nothing was recorded from {:.3g} to {:.3g} {}, and with {} values the error between "
          "them "
          "cannot be determined",
          hole.lowest, hole.highest, unit, values.size());
      proposal.assumed_reduction = kUnknownGain * hole.width() / (to - from);
    } else {
      proposal.expected_reduction = 1.0 - std::sqrt(after / total);
      proposal.assumed_reduction = proposal.expected_reduction;
      if (proposal.expected_reduction < kWorthMentioning) continue;
      proposal.reason = fmt::format(
          "nothing was recorded from {:.3g} to {:.3g} {}; when one value was left out of the "
          "training, the RMSE on it was up to {:.2g} times as large",
          hole.lowest, hole.highest, unit, growth.rmse_ratio);
    }
    advice.proposals.push_back(std::move(proposal));
  }
  return advice;
}

}  // namespace torsio
