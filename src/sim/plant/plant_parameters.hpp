#pragma once

#include <array>
#include <cstdint>
#include <variant>

#include "parts/brake.hpp"
#include "parts/elastomer_coupling.hpp"
#include "parts/friction.hpp"
#include "parts/gear.hpp"
#include "parts/motor.hpp"
#include "parts/rubber_spring.hpp"
#include "parts/slip_clutch.hpp"
#include "parts/spring.hpp"
#include "sim/plant/electrical_drive.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// The parts of one actuator.
struct PlantParameters {
  Motor::Parameters motor;
  LuGreFriction::Parameters rotor_friction;  ///< rotor side; grows with the first stage's torque
  std::variant<Gear::Parameters, SlipClutch::Parameters> first;
  LuGreFriction::Parameters middle_friction;  ///< grows with the second stage's torque
  std::variant<Spring::Parameters, ElastomerCoupling::Parameters, RubberSpring::Parameters,
               Gear::Parameters>
      second;
  LuGreFriction::Parameters bearing;   ///< bearing of the joint, before the load cell
  double joint_viscous_Nms_rad = 0.0;  ///< d, after the load cell
  double rotor_inertia_kg_m2 = 0.0;
  double middle_inertia_kg_m2 = 0.0;
  double joint_inertia_kg_m2 = 0.0;
  double rated_torque_Nm = 0.0;  ///< up to which the stiffest mode is looked for
};
[[nodiscard]] PlantParameters plant_parameters(const DataSheet& sheet);
/// @param seed of the noise of the current sensors
[[nodiscard]] ElectricalDrive::Parameters electrical_parameters(const DataSheet& sheet,
                                                                std::uint64_t seed);
[[nodiscard]] Brake::Parameters brake_parameters(const DataSheet& sheet);

/// @returns turns of the rotor a turn of the joint
[[nodiscard]] double total_ratio(const PlantParameters& parameters) noexcept;

/// @returns the two natural frequencies [Hz], the lower first, of the plant itself: both ends free,
/// no load on the joint, without damping. Springs are taken beyond their play and below their
/// second stage, dry friction as absent, viscoelastic branches as glassy: nothing relaxes within a
/// period.
[[nodiscard]] std::array<double, 2> natural_frequencies(const PlantParameters& parameters);

}  // namespace torsio
