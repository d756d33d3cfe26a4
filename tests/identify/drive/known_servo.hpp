#pragma once

#include "identify/drive/servo_recordings.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio::testing {

/// The drive of `Servo` as a file has it that lacks the rows of its parameters.
inline DriveIdentification known_servo() {
  const Servo servo;
  DriveIdentification drive;
  drive.terms = drive_terms({DriveTerm::base, DriveTerm::load_friction});
  drive.drive = parse_drive_sheet(
      "drive: {law: position, gain: kp_1, error_gain: 0.003, supply: supply_V}", "drive.yaml");
  drive.load = parse_load_sheet("load: {pendulum: {mass: 0.5kg, length: 0.1m}}", "load.yaml");
  drive.step_s = 0.0025;
  drive.values = neutral_drive_values();
  at(drive.values, DriveParameter::torque_constant) = servo.kt;
  at(drive.values, DriveParameter::resistance) = servo.resistance;
  at(drive.values, DriveParameter::armature) = servo.armature;
  at(drive.values, DriveParameter::coulomb) = servo.coulomb;
  at(drive.values, DriveParameter::viscous) = servo.viscous;
  at(drive.values, DriveParameter::load_friction) = 0.1;
  return drive;
}

}  // namespace torsio::testing
