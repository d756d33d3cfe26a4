#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "fit/hammerstein_wiener/wiener_error.hpp"

namespace torsio {

/// How large a Hammerstein-Wiener model is.
struct WienerShape {
  std::size_t zeros = 1;
  std::size_t poles = 2;
  bool is_piecewise_linear = false;
  std::size_t input_values = 3;  ///< degree + 1, or knots
  std::size_t output_values = 4;
  bool operator==(const WienerShape&) const = default;
};

/// Where a search may begin, the best first, two at most: G by Steiglitz-McBride on the linear model,
/// and by a grid of time constants; then the curves by least squares, P for a straight C, C for that P.
/// The states start at rest unless `has_start`.
[[nodiscard]] std::vector<WienerNumbers> wiener_starts(const WienerData& data,
                                                       const WienerShape& shape, bool has_start);

/// G with real poles at well-spread time constants, its numerator by least squares from the inputs
/// to the targets; nothing if the data do not determine such a fit.
[[nodiscard]] std::optional<Sections> slow_start(const WienerData& data, std::size_t zeros,
                                                 std::size_t poles);

}  // namespace torsio
