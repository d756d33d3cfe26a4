#pragma once

#include <cstddef>
#include <span>

#include "torsio/core/matrix.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Puts a model with a state (`HasState`) where its first outputs miss the measured ones least:
///
///     min_s sum_k (y_k(s) - target_k)^2 + 1e-6 spread^2 |s - s_0|^2
///
/// s_0 the state after `reset()`; each state is scaled by what moves the output by the target's spread,
/// so that the last term only decides what the samples leave open. Levenberg-Marquardt by Ceres. The
/// model is left at rest if nothing better is found. Other families are reset.
/// @param features samples x inputs, the first of a record; a row that is not finite is not stepped
/// @param target as many; NaN where not measured
void start_where_measured(AnyModel& model, const Matrix& features, std::span<const double> target);

}  // namespace torsio
