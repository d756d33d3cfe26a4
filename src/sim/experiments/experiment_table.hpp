#pragma once

#include <limits>
#include <span>

#include "sim/bench/bench_program.hpp"
#include "sim/plant/plant.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {

/// The rotor held while three torque triangles of 0.05 Hz pull on the output: the static cycle of
/// every bench.
[[nodiscard]] BenchProgram static_cycle_program(double amplitude_Nm,
                                                LoadCell load_cell = LoadCell::joint);

/// A row of the table of experiments. A name may be in more than one family.
struct ExperimentEntry {
  ExperimentInfo info;
  ActuatorFamily family = ActuatorFamily::series_elastic;
  // Its options.
  bool has_lever = false;
  double highest_torque_share = 1.0;  ///< share of the rated torque
  double highest_torque_Nm = std::numeric_limits<double>::infinity();
  double highest_angle_rad = 0.0;
  bool has_frequency = false;
  bool has_band = false;  ///< lowest and highest frequency
  bool has_impedance = false;
  BenchProgram (*program)(const DataSheet& sheet, const ExperimentSpec& spec) = nullptr;
};

/// One list a family, each in its own file.
[[nodiscard]] std::span<const ExperimentEntry> series_elastic_experiments() noexcept;
[[nodiscard]] std::span<const ExperimentEntry> harmonic_drive_experiments() noexcept;
[[nodiscard]] std::span<const ExperimentEntry> rubber_clutch_experiments() noexcept;
[[nodiscard]] std::span<const ExperimentEntry> elastomer_experiments() noexcept;
/// A lever with a known mass in the air, in several families.
[[nodiscard]] std::span<const ExperimentEntry> air_experiments() noexcept;

/// @throws UsageError that lists the names known for this family.
[[nodiscard]] const ExperimentEntry& experiment_entry(std::string_view name,
                                                      const DataSheet& sheet);

}  // namespace torsio
