#pragma once

#include <functional>
#include <string>
#include <vector>

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// The true state of a bench at one tick, which no sensor measures.
struct BenchTruth {
  const Plant& plant;
  double load_cell_Nm = 0.0;
  double temperature_K = 0.0;
};

/// A `truth_` channel and how it is read.
struct TruthChannel {
  std::string name;
  std::function<double(const BenchTruth&)> value;
};

/// Torques, motions and every internal state of this actuator (docs/simulation/actuators.md).
/// @param is_electrical the plant has an electrical drive
[[nodiscard]] std::vector<TruthChannel> truth_channels(const DataSheet& sheet,
                                                       bool is_electrical = false);

}  // namespace torsio
