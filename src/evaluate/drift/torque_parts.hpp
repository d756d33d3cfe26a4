#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/core/matrix.hpp"

namespace torsio {

/// A model's output over its first input x and the others u_k, taken apart:
///
///     y ~ E(x) + H + sum_k v_k u_k,   H = sum_i (a_i + b_i |x - m| / h) stop_i(x),   a_i, b_i >= 0
///
/// E is straight between knots at equal distances, m and h are middle and half width of the range of x in
/// training, stop_i has the threshold r_i = h times 0.003 to 0.16.
struct TorqueParts {
  std::vector<double> elastic;    ///< E at each sample
  std::vector<double> stiffness;  ///< dE/dx
  std::vector<double> friction;   ///< H
  std::vector<double> widening;   ///< change of H as its thresholds double, at the same forces
  double middle = 0.0;            ///< x0: where E is 0; NaN: nowhere
};

/// The samples of one recording, in the order of time.
struct PartsRun {
  std::span<const double> x;
  const Matrix* features = nullptr;
  std::span<const double> output;  ///< output of the model
  std::vector<std::size_t> rows;   ///< samples that are compared
};

/// @returns the parts at the `rows` of all runs, one after the other.
[[nodiscard]] TorqueParts torque_parts(std::span<const PartsRun> runs, double lowest,
                                       double highest);

}  // namespace torsio
