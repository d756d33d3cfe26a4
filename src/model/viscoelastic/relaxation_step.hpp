#pragma once

#include <cmath>
#include <cstddef>
#include <span>

#include "model/viscoelastic/spring_dashpot_network.hpp"
#include "parts/maxwell_branches.hpp"

// What the model and its fit run sample by sample.
namespace torsio {

/// A branch over a sample period in which u runs straight: z <- decay z + gain (u_n - u_n-1).
struct RelaxationStep {
  double decay = 0.0;
  double gain = 0.0;
};

inline RelaxationStep relaxation_step(const RelaxationBranch& branch, double period_s) {
  const double passed = branch.rate_1_s * period_s;
  return {std::exp(-passed), branch.stiffness * mean_decay(passed)};
}

/// Moves every branch. @returns `value` with all z_i added
template <std::size_t Count>
double relaxed(double value, double moved, std::span<const double, Count> decay,
               std::span<const double, Count> gain, std::span<double, Count> z) noexcept {
  for (std::size_t i = 0; i < z.size(); ++i) {
    z[i] = decay[i] * z[i] + gain[i] * moved;
    value += z[i];
  }
  return value;
}

}  // namespace torsio
