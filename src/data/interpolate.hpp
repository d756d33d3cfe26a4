#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace torsio {

/// Linear interpolation of samples with uneven, strictly increasing stamps at even times from the
/// first stamp on.
[[nodiscard]] std::vector<double> interpolate(std::span<const double> stamps_s,
                                              std::span<const double> values, double sample_rate_Hz,
                                              std::size_t samples);

}  // namespace torsio
