#pragma once

#include <cstddef>
#include <cstdint>

#include "model/mixture/gaussian_mixture.hpp"
#include "torsio/core/matrix.hpp"

namespace torsio::bench {

/// Torque, deflection, deflection rate and joint speed of a lever on a spring with friction.
[[nodiscard]] Matrix spring_samples(std::size_t count, std::uint64_t seed);
/// 5000 components.
[[nodiscard]] const GaussianMixture& full_mixture();
/// 300 components.
[[nodiscard]] const GaussianMixture& small_mixture();

}  // namespace torsio::bench
