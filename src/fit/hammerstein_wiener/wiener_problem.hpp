#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "fit/hammerstein_wiener/wiener_error.hpp"
#include "numerics/residual_search.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio {

/// Numbers as a function of what is searched over, and how they move with it.
/// (theta, packed, slopes): slopes packed x theta, zero when it comes, or no rows.
using WienerChart = std::function<void(std::span<const double>, std::span<double>, Matrix& slopes)>;

/// The numbers themselves.
[[nodiscard]] WienerChart natural_chart();
/// Poles within radius r, that of the slowest, whatever theta: a2 = r^2 tanh(p), a1 = r (1 + tanh(p))
/// tanh(q); the other numbers are themselves.
[[nodiscard]] WienerChart stable_chart(const WienerError& error);
/// Bound of |theta| beyond which a pole hardly moves towards its limit: searches would continue
/// without end.
[[nodiscard]] std::vector<double> stable_bound(const WienerError& error);
[[nodiscard]] std::vector<double> stable_start(const WienerError& error,
                                               std::span<const double> packed);

/// For `minimise_squares`. The samples come as the triangle R of [J r] = Q R: the same squares, gradient
/// and curvature in a few rows.
/// @param parameters length of theta
[[nodiscard]] ResidualProblem wiener_problem(const WienerError& error, std::size_t parameters,
                                             const WienerChart& chart);

}  // namespace torsio
