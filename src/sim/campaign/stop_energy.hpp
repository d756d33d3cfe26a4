#pragma once

#include "sim/plant/plant.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// Removes the power of a joint in this state and closes its brake (`JointStop`, category 0), 0.5 s long,
/// with friction and springs relaxed at the start.
/// @returns the largest gain of the energy of joint, springs and load, over the energy that is in motion and
/// in the springs at the start; NaN if the plant refuses the state
[[nodiscard]] double stop_energy_gain(const DataSheet& sheet, const PlantState& state,
                                      const Load& at_stop);

}  // namespace torsio
