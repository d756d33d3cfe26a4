#pragma once

#include <optional>
#include <vector>

namespace torsio {

/// A speed compared with the derivative of an angle.
struct RateFactor {
  double factor = 1.0;    ///< how many times the derivative it is
  double together = 0.0;  ///< their correlation
};

/// Both over the same windows of 0.1 s, so that noise and the steps of an encoder do not count; empty
/// if they are not correlated.
[[nodiscard]] std::optional<RateFactor> factor_of_rate(const std::vector<double>& speed,
                                                       const std::vector<double>& angle,
                                                       double sample_rate_Hz);

}  // namespace torsio
