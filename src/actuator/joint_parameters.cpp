#include "torsio/actuator/joint_parameters.hpp"

#include <algorithm>
#include <string>
#include <variant>

#include "torsio/actuator/electrical_sheet.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

double stiffness_of(const SpringSheet& spring) { return spring.stiffness_Nm_rad.value; }
double stiffness_of(const ElastomerSheet& coupling) { return coupling.stiffness_Nm_rad.value; }
double stiffness_of(const RubberSheet& rubber) { return rubber.stiffness_Nm_rad.value; }

}  // namespace

Drive drive_of(const DataSheet& sheet) {
  double ratio = std::visit([](const auto& stage) { return stage.ratio.value; }, sheet.first);
  if (const auto* const gear = std::get_if<GearSheet>(&sheet.second)) ratio *= gear->ratio.value;
  return {.ratio = ratio,
          .torque_constant_Nm_A = sheet.motor.torque_constant_Nm_A.value,
          .rotor_inertia_kg_m2 = sheet.motor.rotor_inertia_kg_m2.value,
          .viscous_Nms_rad = sheet.friction.viscous_Nms_rad.value +
                             sheet.motor.viscous_Nms_rad.value * ratio * ratio,
          .coulomb_Nm = sheet.friction.coulomb_Nm.value,
          .rated_current_A = sheet.rating.current_A.value,
          .peak_current_A = sheet.motor.peak_current_ratio.value * sheet.rating.current_A.value,
          .current_time_constant_s = sheet.motor.current_time_constant_s.value,
          .supply_V = sheet.motor.supply_V.value,
          .resistance_Ohm = sheet.motor.winding_resistance_Ohm.value};
}

double speed_limit_of(const DataSheet& sheet) {
  constexpr double kSupplyShare = 0.95;
  const Drive drive = drive_of(sheet);
  return std::min(sheet.rating.speed_rad_s.value,
                  kSupplyShare * drive.supply_V / drive.torque_per_current());
}

SeriesElasticJoint series_elastic_joint(const DataSheet& sheet) {
  SeriesElasticJoint joint = {.drive = drive_of(sheet),
                              .joint_inertia_kg_m2 = sheet.joint.inertia_kg_m2.value,
                              .joint_viscous_Nms_rad = sheet.joint.viscous_Nms_rad.value};
  if (const auto* const gear = std::get_if<GearSheet>(&sheet.second)) {
    const double tube_Nm_rad =
        std::visit([](const auto& stage) { return stage.stiffness_Nm_rad.value; }, sheet.first);
    const double squared_ratio = gear->ratio.value * gear->ratio.value;
    joint.stiffness_Nm_rad = tube_Nm_rad * squared_ratio;
    joint.joint_inertia_kg_m2 += sheet.middle_inertia_kg_m2.value * squared_ratio;
  } else {
    joint.stiffness_Nm_rad = std::visit(
        [](const auto& stage) {
          if constexpr (requires { stiffness_of(stage); }) return stiffness_of(stage);
          return 0.0;
        },
        sheet.second);
  }
  return joint;
}

JointStop::Settings joint_stop_settings(const DataSheet& sheet, double load_Nm) {
  const BrakeSheet brake = brake_sheet(sheet);
  const double static_Nm = brake.static_torque_Nm.value;
  return {.drive = drive_of(sheet),
          .speed_rad_s = sheet.rating.speed_rad_s.value,
          .deceleration_rad_s2 = 2.0 * sheet.rating.speed_rad_s.value,
          .brake_static_Nm = static_Nm,
          .brake_sliding_Nm = brake.sliding_ratio.value * static_Nm,
          .brake_engage_s = brake.engage_s.value,
          .brake_release_s = brake.release_s.value,
          .load_Nm = load_Nm};
}

TubeImpedance::Settings tube_impedance_settings(const DataSheet& sheet,
                                                const TubeImpedance::Gains& gains) {
  const auto* const tube = std::get_if<TubeSheet>(&sheet.first);
  if (tube == nullptr || !std::holds_alternative<GearSheet>(sheet.second))
    throw Error({.place = "tube impedance",
                 .expected = "an actuator with a torsion tube before a gear",
                 .found = std::string(sheet.name)});
  return {.drive = drive_of(sheet),
          .tube_ratio = tube->ratio.value,
          .tube_Nm_rad = tube->stiffness_Nm_rad.value,
          .gains = gains,
          .joint_inertia_kg_m2 = series_elastic_joint(sheet).joint_inertia_kg_m2,
          .joint_viscous_Nms_rad = sheet.joint.viscous_Nms_rad.value};
}

}  // namespace torsio
