#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include "torsio/core/matrix.hpp"

namespace torsio::test {

/// A small model of a family, of two inputs (a deflection of +-0.1 rad and its rate, as
/// `example_features` makes them). A new family specialises this once, in the header of its room in
/// this folder, for the laws and for every test that needs "some model". Tests of certain families
/// include their rooms, tests of all families `support/example_models.hpp`.
template <class Family>
Family example() {
  static_assert(std::is_void_v<Family>,
                "no header of tests/support/examples that is included here has an example() of "
                "this family");
  throw;
}

/// Features for `inputs` inputs: slow oscillations with reversals, the first +-0.1, the second
/// +-0.4, all of them finite and the same at every call.
inline Matrix example_features(std::size_t samples, std::size_t inputs) {
  Matrix features(samples, inputs);
  for (std::size_t n = 0; n < samples; ++n) {
    const double phase = 0.04 * static_cast<double>(n);
    for (std::size_t j = 0; j < inputs; ++j) {
      const auto order = static_cast<double>(j);
      features(n, j) = (0.1 + 0.3 * order) * std::sin(phase * (1.0 + 0.37 * order) + 1.3 * order);
    }
  }
  return features;
}

}  // namespace torsio::test
