#pragma once

#include <cstdint>
#include <string>

#include "sim/bench/bench_program.hpp"
#include "sim/faults/fault_injector.hpp"
#include "sim/plant/plant.hpp"
#include "sim/sensors/sensed_channels.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "sim/sensors/truth_channels.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/wear.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// The conditions of a bench run, without the experiment.
struct BenchRun {
  std::string name;  ///< for messages
  double duration_s = 0.0;
  std::uint64_t seed = 1;
  OperatingConditions conditions = {};
  bool is_electrical = false;  ///< with `ElectricalDrive`
  const FaultSchedule& faults;
};

/// A plant with its sensors and whatever happens to both, tick by tick.
class Bench {
 public:
  /// @throws Error if the plant refuses its load or condition, UsageError as `FaultInjector`.
  Bench(const DataSheet& sheet, const BenchRun& run, const BenchProgram& start);

  /// The sensor signals at this tick, including faults.
  [[nodiscard]] Measurement sense();
  /// The same without the faults, at the last `sense`.
  [[nodiscard]] const Measurement& sound() const noexcept { return sound_; }
  /// The quantities that no sensor measures, at the last `sense`.
  [[nodiscard]] BenchTruth truth() const;
  /// Advances to the next tick. @throws Error if the plant refuses.
  void act(const BenchAction& action);

  [[nodiscard]] double time_s() const noexcept {
    return static_cast<double>(tick_) / kBenchRate_Hz;
  }

 private:
  [[nodiscard]] PlantCondition condition() const noexcept;
  [[nodiscard]] double load_cell_torque() const;
  void require_taken(Fault fault) const;

  std::string name_;
  OperatingConditions conditions_;
  FaultInjector faults_;
  bool changes_;
  LoadCell load_cell_;
  Plant plant_;
  SensorSet sensors_;
  Load load_;
  std::size_t tick_ = 0;
  Measurement sound_;
  double torque_Nm_ = 0.0;  ///< torque at the load cell in this tick
};

}  // namespace torsio
