#pragma once

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/control/design/drive.hpp"

namespace torsio {

/// What the friction of gear and drive adds to a torque at the joint, starting from rest.
inline double with_friction(const DataSheet& sheet, double torque_Nm) {
  const FrictionSheet& f = sheet.friction;
  return torque_Nm + f.static_ratio.value * (f.coulomb_Nm.value + f.load_factor.value * torque_Nm);
}

/// Current [A] that holds a torque at the joint against the friction.
inline double current_under(const DataSheet& sheet, double torque_Nm) {
  return with_friction(sheet, torque_Nm) / drive_of(sheet).torque_per_current();
}

/// Speed [rad/s] under a torque that the supply permits, below 0 where it does not hold the torque:
/// U = R i + k_t N ω, N k_t i = T + friction + F_v ω.
inline double supply_speed(const DataSheet& sheet, double torque_Nm) {
  const Drive drive = drive_of(sheet);
  const double per_A = drive.torque_per_current();
  const double viscous = sheet.friction.viscous_Nms_rad.value;
  return (drive.supply_V - drive.resistance_Ohm * current_under(sheet, torque_Nm)) /
         (per_A + drive.resistance_Ohm * viscous / per_A);
}

}  // namespace torsio
