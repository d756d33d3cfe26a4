#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "sim/plant/plant.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// Makes a schedule happen to what a loop and its logger see, and to a plant.
///
/// A sensor that delivers more slowly than the loop (the load cell) shows its fault from its next
/// delivery on. Neither `apply` nor `condition` allocates, locks or throws.
class FaultInjector {
 public:
  static constexpr std::size_t kMaxFaults = 256;

  /// @param run_s how long the run lasts
  /// @throws UsageError if the actuator has no such sensor or part, if that cannot fail so, for an
  /// amount out of range, a time that is negative or beyond the run, or too many faults.
  FaultInjector(const FaultSchedule& schedule, const DataSheet& sheet,
                double run_s = std::numeric_limits<double>::infinity());

  void reset() noexcept;

  /// Call once per tick, with increasing times.
  void apply(Measurement& measured, double time_s) noexcept TORSIO_REALTIME;
  /// @param sound the condition without these faults (temperature)
  [[nodiscard]] PlantCondition condition(
      double time_s, const PlantCondition& sound = {}) const noexcept TORSIO_REALTIME;

 private:
  struct Window {
    double start_s = 0.0;
    double end_s = 0.0;
    [[nodiscard]] bool holds(double time_s) const noexcept;
  };
  struct SensorFault {
    FaultKind kind = FaultKind::freeze;
    Window window;
    double amount = 0.0;  ///< in the unit of the measurement
    double every_s = 0.0;
    double next_s = 0.0;  ///< from which the next spike is due
    std::optional<double> held = {};
  };
  struct Sensor {
    double Measurement::*value;
    bool Measurement::*is_fresh;
    std::vector<SensorFault> faults = {};
    std::optional<double> delivered = {};
  };
  struct PartFault {
    double PlantCondition::*factor;  ///< null: a stop
    Window window;
    double amount = 0.0;
    double over_s = 0.0;
    double stop_stiffness_Nm_rad = 0.0;
  };
  void add_sensor_fault(const ScheduledFault& fault, const Window& window, const DataSheet& sheet);
  static double changed(SensorFault& fault, double value, double time_s) noexcept TORSIO_REALTIME;

  std::vector<Sensor> sensors_;
  std::vector<PartFault> parts_;
};

}  // namespace torsio
