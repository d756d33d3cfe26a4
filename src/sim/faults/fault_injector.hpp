#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
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

  /// A fault that is not in the schedule, of a sensor or, if `value` is null, of a part.
  struct Injection {
    FaultKind kind = FaultKind::freeze;
    double Measurement::*value = nullptr;
    bool Measurement::*is_fresh = nullptr;
    double PlantCondition::*factor = nullptr;  ///< what a fault of a part changes; null: a stop
    double start_s = 0.0;
    double end_s = std::numeric_limits<double>::infinity();
    double amount = 0.0;  ///< in the unit of the measurement
    double stop_stiffness_Nm_rad = 0.0;
  };
  /// Space for `faults` injections of each of these sensors, and of the parts. Allocates.
  void prepare(std::span<const Injection> sensors, std::size_t faults);
  /// @returns false, and nothing changes, if every space is in use, or none was prepared
  [[nodiscard]] bool inject(const Injection& injection) noexcept TORSIO_REALTIME;
  /// Ends all injections; those of the schedule stay.
  void end_injections() noexcept TORSIO_REALTIME;

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
    std::size_t scheduled = 0;  ///< the faults of the schedule come first
  };
  struct PartFault {
    double PlantCondition::*factor;  ///< null: a stop
    Window window;
    double amount = 0.0;
    double over_s = 0.0;
    double stop_stiffness_Nm_rad = 0.0;
  };
  Sensor& sensor_of(double Measurement::*value, bool Measurement::*is_fresh);
  void add_sensor_fault(const ScheduledFault& fault, const Window& window, const DataSheet& sheet);
  static double changed(SensorFault& fault, double value, double time_s) noexcept TORSIO_REALTIME;

  std::vector<Sensor> sensors_;
  std::vector<PartFault> parts_;
  std::size_t scheduled_parts_ = 0;
};

}  // namespace torsio
