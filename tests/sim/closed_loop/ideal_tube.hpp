#pragma once

#include <variant>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio::test {

/// `harmonic-drive` without dry friction, gear errors, torque ripple and noise, its gear ten times as stiff.
inline DataSheet ideal_tube() {
  DataSheet sheet = data_sheet("harmonic-drive");
  for (SheetValue* value :
       {&sheet.friction.coulomb_Nm, &sheet.friction.load_factor, &sheet.motor.torque_ripple,
        &sheet.joint.bearing_friction_Nm, &sheet.sensors.encoder_jitter_lsb})
    *value = assumed(0.0);
  auto& gear = std::get<GearSheet>(sheet.second);
  gear.hysteresis_rad = gear.error_2_rad = assumed(0.0);
  gear.stiffness_Nm_rad = assumed(1e6);
  for (SheetValue* bits : {&sheet.sensors.motor_encoder_bits, &sheet.sensors.middle_encoder_bits,
                           &sheet.sensors.joint_encoder_bits})
    *bits = assumed(30.0);
  return sheet;
}

}  // namespace torsio::test
