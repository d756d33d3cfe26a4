#pragma once

#include <string>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/evaluate/evaluate.hpp"

namespace torsio {

/// For each recording of a role in which the estimate differs from the target by a constant that is much larger than what
/// remains without it: by how much, which zero explains it (of an angle, of the target, or either), and what to do.
/// The recording is run again with another zero of an angle, where the model has one as an input.
/// @param estimator at the sample rate of the dataset
/// @param score of this estimator on the recordings of that role
[[nodiscard]] std::vector<std::string> offset_warnings(const Estimator& estimator,
                                                       const Dataset& dataset, Role role,
                                                       const SplitScore& score);

}  // namespace torsio
