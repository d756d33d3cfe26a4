#pragma once

#include <cstddef>

#include "fit/common/held_out.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// The range of each input over the usable samples.
[[nodiscard]] FeatureRanges feature_ranges(const TrainingData& data);

/// Least squares of the target on all inputs that are not rates: tasks reach rates that no training
/// record has, and a slope there extrapolates without bound (docs/decisions/0004). Rates, and
/// inputs that are constant or depend linearly on those before them, have slope 0. `residual_std`
/// is sqrt(sum e^2 / (samples - terms)).
[[nodiscard]] LinearFallback linear_fallback(const TrainingData& data);

inline constexpr std::size_t kResidualsPerRegion = 50;
inline constexpr std::size_t kMaxResidualRegions = 16;

/// Root mean square of the model's residuals by region of its own output: up to 16 regions of equal
/// sample count, at least 50 samples each. It is the spread about 0, not about the region's mean,
/// so that a bias of the model is included. Each sequence runs through the model from a reset, as
/// in the loop. Empty where there are fewer than 50 samples.
[[nodiscard]] ResidualTable residual_table(const AnyModel& model, const TrainingData& data);

/// Error bars that are at least those of both tables, over the regions of both; outside of its own, a
/// table has the value of its nearest region.
[[nodiscard]] ResidualTable larger_of(const ResidualTable& first, const ResidualTable& second);

/// Scales the table to a root mean square of at least `rmse` over its regions.
void widen_to(ResidualTable& table, double rmse);

/// The estimator settings around a fitted model in its file. The residual table is from
/// `validation` where given (training residuals are too small for a model with many parameters).
/// Otherwise it is from training, scaled up to what was held out where that is larger, as
/// the model's own error bar is, and to what other recordings need (`HeldOutErrors::factor`). The errors of a target
/// that was computed (`Sequence::target_error`) are added to each of them. `zeroed_channels` are set by the caller, who has the recordings.
[[nodiscard]] EstimatorSettings guarded_settings(const FeatureSpec& features,
                                                 const TrainingData& training,
                                                 const AnyModel& model,
                                                 const TrainingData* validation = nullptr,
                                                 const HeldOutErrors& held_out = {});

}  // namespace torsio
