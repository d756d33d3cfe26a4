#pragma once

#include <cstddef>
#include <vector>

#include "sim/sensors/sensor_set.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/estimate/monitored_torque.hpp"

namespace torsio {

/// A `MonitoredTorque` that is fed with the sensors of a simulated joint and armed as soon as it is ready.
class JointMonitor {
 public:
  /// @throws Error if an input of the monitor is not a channel of this actuator's sensors.
  JointMonitor(MonitoredTorque monitored, const DataSheet& sheet, bool is_electrical = false);

  /// @param current_factor of the measured current; 1 but for the twin of a drifting torque constant
  Monitor::State step(double t_s, const Measurement& measured,
                      double current_factor = 1.0) noexcept;
  /// Ends a stop; armed again when it is ready.
  void restart(double t_s) noexcept { monitored_.monitor().reset(t_s); }

  [[nodiscard]] const Monitor& monitor() const noexcept { return monitored_.monitor(); }
  [[nodiscard]] MonitoredTorque& monitored() noexcept { return monitored_; }
  [[nodiscard]] const MonitoredTorque& monitored() const noexcept { return monitored_; }

  /// The largest difference between two sources, each without that of `sound`.
  /// @param only_valid pass over sources that report a fault: they are not compared
  [[nodiscard]] double changed_difference_Nm(const JointMonitor& sound,
                                             bool only_valid) const noexcept;
  /// The largest difference between two valid sources.
  [[nodiscard]] double difference_Nm() const noexcept;

 private:
  struct Input {
    double Measurement::*value;
    bool Measurement::*is_fresh;
    double scale = 1.0;
    bool is_current = false;
    double measured_s = 0.0;  ///< when the sensor last delivered
  };

  MonitoredTorque monitored_;
  std::vector<Input> inputs_;
  std::vector<SignalSample> raw_;
};

/// Whether the monitor has an input from this sensor.
[[nodiscard]] bool uses(const MonitoredTorque& monitored, std::string_view channel);

}  // namespace torsio
