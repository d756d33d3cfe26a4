#pragma once

#include <string>
#include <vector>

#include "check/quick_model.hpp"
#include "check/region_errors.hpp"
#include "torsio/check/advice.hpp"
#include "torsio/data/dataset.hpp"

namespace torsio {

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
