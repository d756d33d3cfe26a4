#include "torsio/estimate/motor_referenced_torques.hpp"

#include <cmath>
#include <string>
#include <string_view>

#include "core/checks.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::string_view kPlace = "motor-referenced torques";
constexpr double kSteepness = 100.0;  // s/deg, (16): atan(100 q̇)

void require_finite(const DeflectionTorque& of, const std::string& name) {
  const auto require_number = [&](double value, const char* coefficient) {
    require_parameter(std::isfinite(value), kPlace, name + " " + coefficient + " to be finite",
                      value);
  };
  require_number(of.offset_Nm, "offset_Nm");
  require_number(of.stiffness_Nm_rad, "stiffness_Nm_rad");
  require_number(of.viscous_Nms_rad, "viscous_Nms_rad");
  require_number(of.coulomb_Nm, "coulomb_Nm");
}

/// Takes the value if it is finite.
Fault take(double value, bool is_input_finite, double& held) noexcept {
  if (!is_input_finite) return Fault::input_not_finite;
  if (!std::isfinite(value)) return Fault::model_not_finite;
  held = value;
  return Fault::none;
}

/// Load part and sum: both are taken or neither.
Fault take(const DeflectionTorque& of, double deflection_rad, double speed_rad_s, double& load_Nm,
           double& sum_Nm) noexcept {
  const double load = of.offset_Nm + of.stiffness_Nm_rad * deflection_rad;
  const double sum = load + of.viscous_Nms_rad * speed_rad_s +
                     of.coulomb_Nm * MotorReferencedTorques::coulomb_regressor(speed_rad_s);
  const Fault fault =
      take(sum, std::isfinite(deflection_rad) && std::isfinite(speed_rad_s), sum_Nm);
  if (fault == Fault::none) load_Nm = load;
  return fault;
}

}  // namespace

MotorReferencedTorques::MotorReferencedTorques(const Parameters& parameters)
    : parameters_(parameters) {
  require_positive(kPlace, "torque_constant_Nm_A", parameters.torque_constant_Nm_A);
  require_positive(kPlace, "gear_ratio", parameters.gear_ratio);
  require_finite(parameters.gear, "gear");
  require_finite(parameters.spring, "spring");
}

double MotorReferencedTorques::coulomb_regressor(double joint_speed_rad_s) noexcept {
  return std::atan(kSteepness * deg_from_rad(joint_speed_rad_s));
}

MotorReferencedTorques::Output MotorReferencedTorques::step(const JointSample& sample,
                                                            double joint_speed_rad_s) noexcept {
  last_.motor_fault =
      take(parameters_.torque_constant_Nm_A * parameters_.gear_ratio * sample.motor_current_A,
           std::isfinite(sample.motor_current_A), last_.motor_Nm);
  last_.gear_fault = take(parameters_.gear, gear_deflection(sample, parameters_.gear_ratio),
                          joint_speed_rad_s, last_.gear_load_Nm, last_.gear_Nm);
  last_.spring_fault = take(parameters_.spring, spring_deflection(sample), joint_speed_rad_s,
                            last_.spring_load_Nm, last_.spring_Nm);
  return last_;
}

}  // namespace torsio
