#pragma once

#include <cstddef>

#include "model/mixture/dgmm.hpp"
#include "support/examples/example.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::test {

/// Five Gaussians along 600 Nm/rad, and a wide one over them.
template <>
inline Dgmm example<Dgmm>() {
  constexpr std::size_t kComponents = 6;
  Dgmm::Parameters parameters;
  GaussianMixture& mixture = parameters.mixture;
  mixture = {.centre = {0.5, 0.0, 0.0},
             .scale = {40.0, 0.07, 0.3},
             .weights = {0.25, 0.2, 0.15, 0.2, 0.199, 0.001},
             .means = Matrix(kComponents, 3),
             .covariances = Matrix(kComponents, 9)};
  for (std::size_t i = 0; i < kComponents; ++i) {
    const bool is_background = i + 1 == kComponents;
    const double at = is_background ? 0.0 : 0.7 * (static_cast<double>(i) - 2.0);
    const double spread = is_background ? 1.0 : 0.2;
    mixture.means.values[i * 3] = at;
    mixture.means.values[i * 3 + 1] = at;
    mixture.covariances.values[i * 9] = 1.01 * spread;
    mixture.covariances.values[i * 9 + 1] = spread;
    mixture.covariances.values[i * 9 + 3] = spread;
    mixture.covariances.values[i * 9 + 4] = 1.01 * spread;
    mixture.covariances.values[i * 9 + 8] = 1.0;
  }
  parameters.clamp = {.intercept = 0.5,
                      .slope = {570.0, 0.25},
                      .width = 3.0,
                      .thin_log_density = -5.0,
                      .thin_log_density_inverse = -5.0};
  return Dgmm(parameters);
}

}  // namespace torsio::test
