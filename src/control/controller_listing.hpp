#pragma once

#include "torsio/control/pid.hpp"

namespace torsio {

/// The numbers that a `JointController` has computed from its settings, as plain data, for what writes them down in
/// another language. Members of the controllers have the same names.
struct ControllerListing {
  struct Cascade {
    double speed_gain_A_s_rad = 0.0;
    double approach_1_s = 0.0;
    double braking_rad_s2 = 0.0;
    double margin_rad = 0.0;
    double soft_speed_rad_s = 0.0;
    double position_1_s = 0.0;
    Pid::Gains velocity = {};
    double fault_keep = 0.0;
    double transfer_keep = 0.0;
    double thermal_cold = 0.0;  ///< load from which the limit falls
    double thermal_fade = 0.0;
    double thermal_share = 0.0;
  };
  struct Deflection {
    Pid::Gains gains = {};
    double feed_forward_A_rad = 0.0;
    double fault_keep = 0.0;
  };

  Cascade cascade = {};
  Deflection deflection = {};
  double largest_torque_Nm = 0.0;
  double torque_transfer_keep = 0.0;
  double pid_transfer_keep = 0.0;  ///< the same in both loops
  double impedance_transfer_keep = 0.0;
  double impedance_fault_keep = 0.0;
};

}  // namespace torsio
