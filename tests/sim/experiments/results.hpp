// What the tests read from the results of a simulation.

#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "sim/plant/energy_audit.hpp"

namespace torsio::test {

/// The largest absolute value.
inline double largest(std::span<const double> values) {
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

inline double range(std::span<const double> values) {
  const auto [low, high] = std::ranges::minmax_element(values);
  return *high - *low;
}

/// What the two stages of a joint with rubber have lost: their ports of Plant::work_ports. The other
/// friction, which loses far more, would hide their falls.
inline double stage_loss(const EnergyAudit& audit) {
  return audit.port_loss(8) + audit.port_loss(9);
}

}  // namespace torsio::test
