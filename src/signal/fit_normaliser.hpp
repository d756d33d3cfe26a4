#pragma once

#include <cstddef>
#include <functional>
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

/// Calls its argument with each sample, every time in the same order.
using EachSample = std::function<void(const std::function<void(std::span<const double>)>&)>;

/// The same from samples that are visited twice, so that no table of them is needed.
[[nodiscard]] Normaliser fit_normaliser(std::size_t channels, const EachSample& each_sample,
                                        std::span<const double> scale_floors = {});

}  // namespace torsio
