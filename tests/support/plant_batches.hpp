#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sim/plant/plant.hpp"
#include "torsio/core/random.hpp"

namespace torsio::test {

/// One actuator of each chain of stages, under the name that `data_sheet` takes.
inline const std::vector<std::string>& every_chain() {
  static const std::vector<std::string> names = {
      "dfki-50",          "dfki-120:bouc-wen",  "dfki-28:lugre",
      "elastomer:bonded", "elastomer:unbonded", "elastomer:creeping",
      "rubber-clutch",    "harmonic-drive:soft"};
  return names;
}

/// Plants of one data sheet that differ by some per cent, and what drives each of them for a
/// millisecond at a time.
struct BatchInputs {
  std::vector<PlantParameters> parameters;
  std::vector<std::vector<PlantCommand>> commands;  ///< [tick][plant]
  std::vector<std::vector<Load>> loads;
};

inline PlantParameters spread(PlantParameters of, Random& random) {
  const auto vary = [&](double& value) { value *= 1.0 + 0.1 * (random.uniform() - 0.5); };
  for (double* value :
       {&of.motor.torque_constant_Nm_A, &of.motor.current_time_constant_s,
        &of.rotor_friction.coulomb_Nm, &of.bearing.coulomb_Nm, &of.joint_viscous_Nms_rad,
        &of.rotor_inertia_kg_m2, &of.middle_inertia_kg_m2, &of.joint_inertia_kg_m2})
    vary(*value);
  std::visit([&](auto& stage) { vary(stage.stiffness_Nm_rad); }, of.first);
  std::visit(
      [&](auto& stage) {
        if constexpr (requires { stage.elastic; }) {
          vary(stage.elastic.stiffness_Nm_rad);
          vary(stage.elastic.half_gap_rad);
        } else {
          vary(stage.stiffness_Nm_rad);
        }
      },
      of.second);
  return of;
}

/// @param first the number of the first plant: plant k of any batch is the same one
inline BatchInputs batch_inputs(const std::string& actuator, std::size_t first, std::size_t count,
                                std::size_t ticks) {
  const DataSheet sheet = data_sheet(actuator);
  const double rated_Nm = sheet.rating.torque_Nm.value;
  BatchInputs inputs;
  inputs.commands.assign(ticks, std::vector<PlantCommand>(count));
  inputs.loads.assign(ticks, std::vector<Load>(count));
  for (std::size_t i = 0; i < count; ++i) {
    Random random(100 + first + i);
    inputs.parameters.push_back(spread(plant_parameters(sheet), random));
    PlantCommand command;
    Load load{.inertia_kg_m2 = 0.01 * rated_Nm, .gravity_Nm = 0.3 * rated_Nm};
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      if (tick % 20 == 0) {
        command = {.current_A = sheet.rating.current_A.value * random.normal(),
                   .is_motor_held = random.below(10) == 0};
        load.external_torque_Nm = 0.3 * rated_Nm * random.normal();
        load.is_locked = random.below(10) == 0;
        load.wall_angle_rad = random.below(4) == 0 ? 0.2 : 1e9;
        load.wall_stiffness_Nm_rad = 20.0 * rated_Nm;
        load.wall_damping_Nms_rad = 0.01 * rated_Nm;
      }
      inputs.commands[tick][i] = command;
      inputs.loads[tick][i] = load;
    }
  }
  return inputs;
}

}  // namespace torsio::test
