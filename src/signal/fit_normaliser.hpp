#pragma once

#include <span>

#include "torsio/core/matrix.hpp"
#include "torsio/signal/normaliser.hpp"

namespace torsio {

/// Mean and standard deviation (divided by n) of each column, so that a channel that hardly moves
/// is not blown up: the scale is at least `scale_floors[j]`, and 1 for a channel without a floor
/// that is constant to rounding.
/// @param data samples x channels
/// @param scale_floors one per channel, or empty for none (specification 3.1 lists the ones of the
/// dgmm)
/// @throws UsageError if there is no sample, a value is not finite, or the floors do not fit.
[[nodiscard]] Normaliser fit_normaliser(const Matrix& data,
                                        std::span<const double> scale_floors = {});

}  // namespace torsio
