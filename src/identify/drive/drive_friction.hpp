#pragma once

#include "torsio/identify/drive/drive_model.hpp"

namespace torsio {

/// The largest torque of the friction on the motor's side in steady motion [Nm],
///
///     coulomb + load_friction L + load_stribeck L exp(-|v| / load_speed) + stribeck exp(-|v| / stribeck_speed)
///     + viscous |v|
///
/// A term that the drive does not have is 0 by its neutral value.
/// @param speed_rad_s v, of the motor after the gear
/// @param load_Nm L of the equations of `DriveParameter`, at least 0
[[nodiscard]] double drive_friction_Nm(const DriveValues& values, double speed_rad_s,
                                       double load_Nm);

}  // namespace torsio
