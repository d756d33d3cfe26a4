#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

#include "model/mixture/gaussian_mixture.hpp"

namespace torsio::test {

/// How a random mixture spreads. Each component's standard deviation is drawn log-uniformly.
struct MixtureShape {
  std::size_t components = 50;
  std::size_t dimension = 4;
  double narrowest = 0.1;
  double widest = 0.3;
  bool background = false;  ///< one more component with the spread of all means
};

inline GaussianMixture random_mixture(const MixtureShape& shape, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const std::size_t d = shape.dimension;
  const std::size_t m = shape.components + (shape.background ? 1 : 0);
  GaussianMixture mixture;
  mixture.weights.resize(m);
  mixture.means = Matrix(m, d);
  mixture.covariances = Matrix(m, d * d);
  for (std::size_t j = 0; j < d; ++j) {
    mixture.centre.push_back(normal(random));
    mixture.scale.push_back(0.2 + uniform(random));
  }
  double total = 0.0;
  for (std::size_t i = 0; i < m; ++i) {
    const bool is_background = i >= shape.components;
    mixture.weights[i] = is_background ? 1e-3 * total : 0.1 + uniform(random);
    total += mixture.weights[i];
    const double spread =
        is_background ? 1.0
                      : shape.narrowest * std::pow(shape.widest / shape.narrowest, uniform(random));
    Matrix root(d, d + 1);
    for (double& value : root.values)
      value = spread * normal(random) / std::sqrt(static_cast<double>(d));
    for (std::size_t r = 0; r < d; ++r) {
      mixture.means(i, r) = is_background ? 0.0 : normal(random);
      for (std::size_t c = 0; c < d; ++c) {
        double value = r == c ? 0.1 * spread * spread : 0.0;
        for (std::size_t k = 0; k <= d; ++k) value += root(r, k) * root(c, k);
        mixture.covariances(i, r * d + c) = value;
      }
    }
  }
  for (double& weight : mixture.weights) weight /= total;
  return mixture;
}

}  // namespace torsio::test
