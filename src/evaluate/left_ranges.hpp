#pragma once

#include <string>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {

/// For each input of a model that leaves its range of the training in at least one of a hundred held-out samples: how
/// far, how often, and which recording would contain it. A guard reports these samples (`Fault::outside_training_range`).
/// An input without effect on the model is stated as such, instead of a recording.
/// @param settings at the sample rate of the dataset
/// @param has_offset the estimate is a constant off (`offset_warnings`): its cause is to be removed first
/// @throws Error as `Recording::channel` if a raw input is missing.
[[nodiscard]] std::vector<std::string> left_range_warnings(const EstimatorSettings& settings,
                                                           const AnyModel& model,
                                                           const Dataset& dataset,
                                                           bool has_offset = false);

}  // namespace torsio
