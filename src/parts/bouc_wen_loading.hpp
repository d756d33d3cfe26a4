#pragma once

#include <algorithm>

namespace torsio {

/// z after a travel of dz/du = 1 - z^n from z >= 0, by midpoint steps of at most `longest_step`;
/// below 1/n, they cannot overshoot z = 1.
/// @param settled travel after which what is missing to 1 is below its last bit
/// @param power z -> z^n
template <class Power>
double bouc_wen_loading(double z, double travel, double longest_step, double settled,
                        const Power& power) noexcept {
  if (z >= 1.0 || travel >= settled) return 1.0;
  const int steps = 1 + static_cast<int>(travel / longest_step);
  const double step = travel / steps;
  for (int i = 0; i < steps; ++i) {
    const double middle = z + 0.5 * step * (1.0 - power(z));
    z += step * (1.0 - power(middle));
  }
  return std::min(z, 1.0);
}

}  // namespace torsio
