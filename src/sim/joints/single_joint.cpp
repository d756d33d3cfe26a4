#include "torsio/sim/joints/single_joint.hpp"

#include <cmath>

#include "core/checks.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr auto kLinkPlace = "link of a single joint";
constexpr double kGravity_m_s2 = 9.81;
constexpr double kSpeedUp_s = 0.5;
/// The axis z is horizontal, and x points down.
constexpr Matrix3 kHanging = {0.0, -1.0, 0.0, 0.0, 0.0, 1.0, -1.0, 0.0, 0.0};

}  // namespace

ArmSetup single_joint_setup(const DataSheet& sheet, const SingleLink& link) {
  if (sheet.family == ActuatorFamily::harmonic_drive)
    throw UsageError({.place = "joint with " + full_name(sheet),
                      .expected = "an actuator with its spring at the output",
                      .found = "a torsion tube before its last gear",
                      .advice = "Its impedance is controlled by another controller: torsio track "
                                "--impedance."});
  require_positive(kLinkPlace, "its length [m]", link.length_m);
  const double mass_kg = link.mass_kg.value_or(kDefaultWeightShare * sheet.rating.torque_Nm.value /
                                               (kGravity_m_s2 * link.length_m));
  require_positive(kLinkPlace, "its mass [kg]", mass_kg);
  const double inertia_kg_m2 = sheet.joint.inertia_kg_m2.value;
  ArmJoint joint{.name = "joint",
                 .link = "link",
                 .body = {.mass_kg = mass_kg,
                          .com_m = {link.length_m, 0.0, 0.0},
                          .inertia_kg_m2 = {inertia_kg_m2, inertia_kg_m2, inertia_kg_m2}},
                 .lowest_rad = -kSingleJointRange_rad,
                 .highest_rad = kSingleJointRange_rad,
                 .speed_rad_s = speed_limit_of(sheet),
                 .effort_Nm = sheet.rating.torque_Nm.value};
  if (!link.has_vertical_axis) joint.origin.rotation = kHanging;
  ArmSetup setup{.arm = {.name = full_name(sheet), .joints = {joint}},
                 .joints = {{.sheet = sheet}}};
  setup.moves = move_limits(setup.arm, kSpeedUp_s);
  require_carriable(setup, kLinkPlace);
  return setup;
}

}  // namespace torsio
