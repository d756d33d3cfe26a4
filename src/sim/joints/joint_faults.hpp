#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "sim/faults/fault_injector.hpp"
#include "torsio/link/link_messages.hpp"

namespace torsio {

/// Faults that a host injects into a joint: those of a schedule, from now on.
///
///     fault               channel            magnitude
///     freeze, jump, ...   that of a sensor   that of `FaultKind`, in the unit of the channel
///     break, bottom       0                  share that is left of the spring's torque; deflection of the stop
///     friction, torque-constant  0           factor
class JointFaults {
 public:
  /// Sensors of the telemetry's channels from 0 on; null: not a sensor.
  struct Sensor {
    double Measurement::*value = nullptr;
    bool Measurement::*is_fresh = nullptr;
    bool is_angle = false;  ///< whose encoder has turns
  };
  static constexpr std::size_t kPerSensor = 16;

  /// Makes space in the injector. Allocates. @param stop_Nm_rad stiffness of a stop of the spring
  JointFaults(std::span<const Sensor> sensors, double stop_Nm_rad);
  void prepare(FaultInjector& injector) const;

  /// @returns `none`; `unknown_value` for a fault without that name; `out_of_range` for a channel without a sensor, `wrap` of
  /// another quantity than an angle, or a magnitude that is not possible; `not_in_this_state` if `kPerSensor` are in effect
  [[nodiscard]] LinkRefusal inject(FaultInjector& injector, const LinkInjectFault& fault,
                                   double time_s) const noexcept TORSIO_REALTIME;

 private:
  std::vector<Sensor> sensors_;
  double stop_Nm_rad_;
};

}  // namespace torsio
