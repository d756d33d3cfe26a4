#pragma once

#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Time after which a model that was reset in the middle of a training sequence agrees with the same
/// model run from the sequence's beginning, to within the smallest error bar of `residuals`, and does
/// so until the end of the comparison. The longest over resets at `kWarmUpStarts` places, times
/// `kWarmUpSafety`; a multiple of the sample period.
/// @returns NaN without error bars, or where the two do not agree within `kLongestWarmUpSeconds` or
/// before the sequence ends
[[nodiscard]] double warm_up_s(const AnyModel& model, const TrainingData& data,
                               const ResidualTable& residuals);
inline constexpr int kWarmUpStarts = 60;
inline constexpr double kWarmUpSafety = 4.0;
inline constexpr double kLongestWarmUpSeconds = 10.0;

}  // namespace torsio
