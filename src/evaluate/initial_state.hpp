#pragma once

#include <cstddef>
#include <span>

#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Sets a model with a state (`HasState`) to the state whose first outputs fit the measured ones
/// best:
///
///     min_s mean_k (y_k(s) - target_k)^2 / e^2 + |s - s_0|^2 / 25
///
/// s_0 is the state after `reset()`, each state scaled by the change that moves the output by the
/// target's spread; e is the usual error of the model. Its errors are correlated over more than a
/// few samples, so that these count as one: a slow state is not moved far to explain a small slope.
/// Levenberg-Marquardt. The model remains at rest if nothing better is found. Other
/// families are reset.
/// @param features samples x inputs, the first of a recording; a row that is not finite is not
/// stepped
/// @param target as many; NaN where not measured
/// @param usual_error e, in the target's unit; 0 or NaN if unknown: a hundredth of the target's
/// spread
void start_where_measured(AnyModel& model, const Matrix& features, std::span<const double> target,
                          double usual_error);

}  // namespace torsio
