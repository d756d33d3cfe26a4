#pragma once

#include <cstddef>
#include <span>

#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Puts a model with a state (`HasState`) where its first outputs miss the measured ones least:
///
///     min_s mean_k (y_k(s) - target_k)^2 / e^2 + |s - s_0|^2 / 25
///
/// s_0 the state after `reset()`, each state scaled by what moves the output by the target's spread; e
/// what the model is usually wrong by. Its errors last longer than a few samples, so these count as
/// one: a slow state is not moved far to explain a small slope. Levenberg-Marquardt by Ceres. The model
/// is left at rest if nothing better is found. Other families are reset.
/// @param features samples x inputs, the first of a record; a row that is not finite is not stepped
/// @param target as many; NaN where not measured
/// @param usual_error e, in the target's unit; 0 or NaN if unknown: a hundredth of the target's spread
void start_where_measured(AnyModel& model, const Matrix& features, std::span<const double> target,
                          double usual_error);

}  // namespace torsio
