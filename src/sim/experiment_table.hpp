#pragma once

#include <functional>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/sim/experiment.hpp"
#include "torsio/sim/plant.hpp"
#include "torsio/sim/sensor_set.hpp"

namespace torsio {

/// What the bench does to the plant until the next tick.
struct BenchAction {
  PlantCommand command;
  Load load;
};

/// An experiment that is ready to run: its load at the start, and what follows each measurement.
struct BenchProgram {
  Load start;
  double duration_s = 0.0;
  std::function<BenchAction(const Measurement&)> next;
};

/// A row of the table of experiments.
struct ExperimentEntry {
  ExperimentInfo info;
  bool has_lever = false;
  BenchProgram (*program)(const DataSheet& sheet, const ExperimentSpec& spec) = nullptr;
};

constexpr double kBenchRate_Hz = 1000.0;

/// @throws UsageError that lists the known names.
[[nodiscard]] const ExperimentEntry& experiment_entry(std::string_view name);

}  // namespace torsio
