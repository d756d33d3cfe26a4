#pragma once

#include <string>
#include <vector>

#include "check/advise/quick_model.hpp"
#include "check/advise/region_errors.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

/// A proposal that reduces the RMSE by a smaller share is not made.
inline constexpr double kWorthMentioning = 0.01;

/// The conditions that every training recording has, with a value for each of these.
[[nodiscard]] std::vector<ConditionValues> conditions_of(const Dataset& dataset);

struct ConditionAdvice {
  std::vector<Proposal> proposals;
  std::vector<std::string> undetermined;
};

/// Which value of a condition is missing. Each value in turn is left out of the training; how fast
/// the squared error on it grows, by the width of the hole that it leaves, gives the error expected
/// in the gaps between the values and beyond them.
/// @param wanted its range; null: that of the recordings
[[nodiscard]] ConditionAdvice advise_on_condition(const ConditionValues& condition,
                                                  const WantedRange* wanted,
                                                  const RegionErrors& errors);

}  // namespace torsio
