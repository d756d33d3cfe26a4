#include "sim/plant/plant.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/checks.hpp"
#include "plant_input.hpp"
#include "steepest_slopes.hpp"

namespace torsio {
namespace {

constexpr double kGravity_m_s2 = 9.81;

/// The obstacle's torque against the joint.
double wall_torque(const Load& load, double angle_rad, double speed_rad_s) noexcept {
  const double depth_rad = angle_rad - load.wall_angle_rad;
  if (!(depth_rad > 0.0)) return 0.0;
  return std::max(0.0,
                  load.wall_stiffness_Nm_rad * depth_rad + load.wall_damping_Nms_rad * speed_rad_s);
}

struct StepLimits {
  double stiffness_s = 0.0;
  double damping_s = 0.0;
};

StepLimits step_limits(const PlantParameters& parameters) {
  // The largest row sum of M^-1 K bounds its largest eigenvalue. The speeds are scaled so that
  // each body moves as much as the next one.
  const ChainSlopes stiff = steepest_slopes(parameters);
  const double rotor = parameters.rotor_inertia_kg_m2;
  const double middle = parameters.middle_inertia_kg_m2;
  const double joint = parameters.joint_inertia_kg_m2;
  // Off-diagonal terms couple two neighbours: sqrt(k/m1 * k/m2) each, which their sum bounds.
  const double coupled = stiff.first / (stiff.first_ratio * std::sqrt(middle * rotor)) +
                         stiff.second / (stiff.second_ratio * std::sqrt(middle * joint));
  const double own =
      std::max({stiff.rotor() / rotor, stiff.middle() / middle, stiff.joint() / joint});

  const ChainSlopes viscous = viscous_slopes(parameters);
  const double rates_1_s = std::max({viscous.rotor() / rotor, viscous.middle() / middle,
                                     (viscous.joint() + parameters.joint_viscous_Nms_rad) / joint});
  return {.stiffness_s = 0.25 / std::sqrt(own + coupled), .damping_s = 0.5 / rates_1_s};
}

}  // namespace

Load lever(double mass_kg, double length_m, double inclination_rad) {
  if (!(mass_kg >= 0.0 && length_m >= 0.0 && std::isfinite(mass_kg * length_m) &&
        std::isfinite(inclination_rad))) {
    throw Error({.place = "lever",
                 .problem = "impossible parameter",
                 .expected = "mass and length >= 0 and finite",
                 .found = fmt::format("{} kg at {} m, inclined by {} rad", mass_kg, length_m,
                                      inclination_rad)});
  }
  return {.inertia_kg_m2 = mass_kg * length_m * length_m,
          .gravity_Nm = mass_kg * length_m * kGravity_m_s2 * std::cos(inclination_rad)};
}

Plant::Plant(const PlantParameters& parameters, double longest_step_s)
    : drive_(parameters), longest_step_s_(longest_step_s) {
  require_positive("plant", "joint_inertia_kg_m2", parameters.joint_inertia_kg_m2);
  const StepLimits limits = step_limits(parameters);
  const double limit_s = std::min(limits.stiffness_s, limits.damping_s);
  if (longest_step_s == 0.0) longest_step_s_ = std::min(limit_s, kDefaultStep_s);
  if (!(longest_step_s_ > 0.0 && longest_step_s_ <= limit_s)) {
    const bool is_stiff = limits.stiffness_s <= limits.damping_s;
    throw Error({.place = "plant",
                 .problem = is_stiff ? "the step does not suit the stiffest mode"
                                     : "the step does not suit the strongest damping",
                 .expected = fmt::format("0 s < step <= {:.3g} s", limit_s),
                 .found = fmt::format("{:.3g} s", longest_step_s_),
                 .advice = is_stiff ? "shorten the step, or soften the stiffest spring"
                                    : "shorten the step, or lower the viscous terms"});
  }
  stiffest_stop_Nm_rad_ = stiffest_stop(parameters, longest_step_s_);
  reset();
}

double Plant::step_limit(const PlantParameters& parameters) {
  const StepLimits limits = step_limits(parameters);
  return std::min(limits.stiffness_s, limits.damping_s);
}

double Plant::stiffest_stop(const PlantParameters& parameters, double step_s) {
  return DriveTrain(parameters).stiffest_stop(parameters.joint_inertia_kg_m2, step_s);
}

void Plant::set_period(double dt_s) noexcept {
  asked_dt_s_ = dt_s;
  small_steps_ = small_steps(dt_s, longest_step_s_);
  dt_s_ = dt_s / static_cast<double>(small_steps_);
  drive_.set_period(dt_s_);
}

Fault Plant::reset(const PlantState& state) noexcept {
  if (!is_finite(state)) return Fault::input_not_finite;
  state_ = state;
  torques_ = {};
  drive_.reset(state_);
  return Fault::none;
}

Fault Plant::reset(double joint_angle_rad, const Load& load) noexcept {
  if (!std::isfinite(joint_angle_rad) || !is_usable({}, load)) return Fault::input_not_finite;
  const double torque_Nm =
      load.is_locked ? 0.0 : load.gravity_Nm * std::sin(joint_angle_rad) - load.external_torque_Nm;
  const PlantState rest = drive_.rest(joint_angle_rad, torque_Nm);
  if (!is_finite(rest)) return Fault::input_not_finite;
  state_ = rest;
  torques_ = drive_.reset_at_rest(state_, torque_Nm);
  return Fault::none;
}

Fault Plant::step(const PlantCommand& command, const Load& load, double dt_s) noexcept {
  if (!is_usable(dt_s, longest_step_s_) || !is_usable(command, load))
    return Fault::input_not_finite;
  if (dt_s != asked_dt_s_) set_period(dt_s);
  if (!is_soft_enough(load, parameters().joint_inertia_kg_m2, dt_s_))
    return Fault::input_not_finite;
  for (std::size_t i = 0; i < small_steps_; ++i) small_step(command, load);
  if (is_finite(state_)) return Fault::none;
  reset();
  return Fault::model_not_finite;
}

void Plant::small_step(const PlantCommand& command, const Load& load) noexcept {
  PlantState& s = state_;
  PlantTorques& t = torques_;
  drive_.find_torques(command, s, t);
  t.wall_Nm = wall_torque(load, s.joint_angle_rad, s.joint_speed_rad_s);
  const double joint_Nm = t.joint_Nm + load.external_torque_Nm - t.wall_Nm -
                          parameters().joint_viscous_Nms_rad * s.joint_speed_rad_s -
                          load.gravity_Nm * std::sin(s.joint_angle_rad);
  drive_.move(command, t, s);
  s.joint_speed_rad_s =
      load.is_locked
          ? 0.0
          : s.joint_speed_rad_s +
                dt_s_ * joint_Nm / (parameters().joint_inertia_kg_m2 + load.inertia_kg_m2);
  s.joint_angle_rad += dt_s_ * s.joint_speed_rad_s;
}

}  // namespace torsio
