#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "sim/plant/electrical_drive.hpp"
#include "sim/plant/plant_parameters.hpp"
#include "sim/plant/stages.hpp"
#include "sim/plant/work_port.hpp"
#include "torsio/core/dispatch.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// What drives the plant.
struct PlantCommand {
  double current_A = 0.0;      ///< wanted motor current
  bool is_motor_held = false;  ///< the rotor is clamped; the current has no effect
  bool is_powered = true;      ///< false: the inverter is off, and there is no current at once
  double brake_V = 0.0;        ///< voltage at the coil of the brake, if there is one
};

/// Wear and faults of a plant while it runs; the defaults are a plant without faults.
struct PlantCondition {
  double friction_factor = 1.0;         ///< factor of the friction at rotor and middle body
  double torque_constant_factor = 1.0;  ///< factor of k_t that the current loop does not include
  double second_stage_factor = 1.0;     ///< factor of the second stage's torque; 0: broken
  /// Where the second stage's twist meets a hard stop (a bottomed spring).
  double stop_twist_rad = std::numeric_limits<double>::infinity();
  double stop_stiffness_Nm_rad = 0.0;
};

struct PlantState {
  double rotor_angle_rad = 0.0;
  double rotor_speed_rad_s = 0.0;
  double middle_angle_rad = 0.0;
  double middle_speed_rad_s = 0.0;
  double joint_angle_rad = 0.0;
  double joint_speed_rad_s = 0.0;
};
[[nodiscard]] inline bool is_finite(const PlantState& s) noexcept {
  return std::isfinite(s.rotor_angle_rad + s.rotor_speed_rad_s + s.middle_angle_rad +
                       s.middle_speed_rad_s + s.joint_angle_rad + s.joint_speed_rad_s);
}

/// The torques of the last step.
struct PlantTorques {
  double motor_Nm = 0.0;             ///< on the rotor, ripple included
  double rotor_friction_Nm = 0.0;    ///< against the rotor
  double first_Nm = 0.0;             ///< torque of the first stage on the middle body
  double first_on_rotor_Nm = 0.0;    ///< against the rotor
  double middle_friction_Nm = 0.0;   ///< against the middle body
  double second_Nm = 0.0;            ///< torque of the second stage on the joint
  double second_on_middle_Nm = 0.0;  ///< against the middle body
  double bearing_Nm = 0.0;           ///< dry friction of the joint, against it
  double joint_Nm = 0.0;             ///< torque at a load cell between joint and lever
  double wall_Nm = 0.0;              ///< torque of the obstacle, against the joint
  double brake_Nm = 0.0;             ///< against the rotor
};

/// How the first stage joins rotor and middle body.
enum class FirstStageForm {
  elastic,  ///< as its parameters describe it
  rigid,    ///< they turn together, in its ratio
};

/// Motor, brake, rotor, first stage, middle body, second stage and bearing of one actuator: all that
/// is before the load cell. Whoever owns it moves the joint.
///
///     J_r ω̇_r = τ_motor − τ_rf − τ_brake − τ₁ x₁′
///     J_m ω̇_m = τ₁ − τ_mf − τ₂ x₂′
///     τ_joint = τ₂ − τ_bearing
///
/// xᵢ is the transmitted angle of a stage and xᵢ′ its slope: θ/N + ε(θ) for a gear, θ for a spring.
/// With a rigid first stage rotor and middle body are one, θ_r = N θ_m, and the stage has neither
/// kinematic error, elasticity, damping nor hysteresis:
///
///     (J_r N² + J_m) ω̇_m = N (τ_motor − τ_rf − τ_brake) − τ_mf − τ₂ x₂′
///     τ₁ = J_m ω̇_m + τ_mf + τ₂ x₂′
///
/// τ_rf grows with |τ₁|; for a rigid stage that is the torque of the step before, since this one's
/// depends on τ_rf.
///
/// A step is semi-implicit Euler: `find_torques` from the state before it, then `move` (speeds, then
/// positions). The current, the friction bristles and the viscoelastic branches are solved exactly.
class DriveTrain {
 public:
  static constexpr std::size_t kWorkPorts = 9;

  /// @throws Error if an inertia of rotor or middle body is not positive, a part is impossible, or a
  /// stage that slips has to be rigid.
  explicit DriveTrain(const PlantParameters& parameters,
                      FirstStageForm form = FirstStageForm::elastic);

  [[nodiscard]] const PlantParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] bool has_rigid_first() const noexcept { return is_rigid_; }
  /// @returns J_m; with a rigid first stage J_r N² + J_m [kg m2]
  [[nodiscard]] double middle_inertia() const noexcept { return middle_inertia_kg_m2_; }
  /// The stiffest stop [Nm/rad] that such steps follow with this inertia on the joint's side: half a
  /// radian of the mode of the two bodies that it throws against each other.
  [[nodiscard]] double stiffest_stop(double joint_inertia_kg_m2, double step_s) const noexcept;

  /// From now on the motor is this one, with inverter and current control, instead of the lag of
  /// `Motor`; without current until a reset. @throws Error as `ElectricalDrive`.
  void use(const ElectricalDrive::Parameters& electrical) { electrical_.emplace(electrical); }
  /// From now on there is a brake on the rotor, closed. @throws Error as `Brake`, or if the steps are
  /// too long for its bristle.
  void use(const Brake::Parameters& brake, double longest_step_s);
  [[nodiscard]] const ElectricalDrive* electrical() const noexcept {
    return electrical_ ? &*electrical_ : nullptr;
  }
  [[nodiscard]] const Brake* brake() const noexcept { return brake_ ? &*brake_ : nullptr; }
  void set_brake(bool is_closed) noexcept {
    if (brake_) brake_->reset(is_closed);
  }
  /// @returns Fault::input_not_finite, and the condition stays as it is, if a factor is outside 0
  /// to 1000, the stop's twist negative, or its stiffness negative or above the stiffest one
  Fault set_condition(const PlantCondition& condition, double stiffest_stop_Nm_rad) noexcept;
  [[nodiscard]] const PlantCondition& condition() const noexcept { return condition_; }

  /// Call before the first step and whenever dt changes.
  void set_period(double dt_s) noexcept;

  /// @returns the bodies at rest, with the stages carrying this torque on the joint
  [[nodiscard]] PlantState rest(double joint_angle_rad, double torque_Nm) const noexcept;
  /// Without current, all friction relaxed; a rigid first stage moves the rotor to the middle body.
  void reset(PlantState& state) noexcept;
  /// All friction relaxed, with the current that holds `rest(…, torque_Nm)`.
  /// @returns the torques there
  PlantTorques reset_at_rest(PlantState& rest, double torque_Nm) noexcept;

  /// From the state before the step all torques but `wall_Nm`, which is not changed.
  void find_torques(const PlantCommand& command, const PlantState& state,
                    PlantTorques& torques) noexcept TORSIO_REALTIME;
  /// Advances rotor and middle body.
  void move(const PlantCommand& command, PlantTorques& torques,
            PlantState& state) const noexcept TORSIO_REALTIME;

  [[nodiscard]] double current() const noexcept {
    return electrical_ ? electrical_->current() : motor_.current();
  }  ///< [A], that makes torque
  [[nodiscard]] const FirstStage& first() const noexcept { return first_; }
  [[nodiscard]] const SecondStage& second() const noexcept { return second_; }
  [[nodiscard]] const LuGreFriction& rotor_friction() const noexcept { return rotor_friction_; }
  [[nodiscard]] const LuGreFriction& middle_friction() const noexcept { return middle_friction_; }
  [[nodiscard]] const LuGreFriction& bearing() const noexcept { return bearing_; }

  /// @returns twist [rad] and hysteretic torque [Nm] of a stage
  [[nodiscard]] double first_twist(const PlantState& state) const noexcept;
  [[nodiscard]] double second_twist(const PlantState& state) const noexcept;
  [[nodiscard]] double first_friction_torque() const noexcept;
  [[nodiscard]] double second_friction_torque() const noexcept;

  /// Motor, friction of rotor, middle body and bearing, damping of the first and second stage, their
  /// hysteresis, brake.
  [[nodiscard]] std::array<WorkPort, kWorkPorts> work_ports(
      const PlantState& state, const PlantTorques& torques) const noexcept;
  /// @returns the energy [J] of rotor and middle body, and that in the springs of the stages
  [[nodiscard]] double kinetic_energy(const PlantState& state) const noexcept;
  [[nodiscard]] double elastic_energy(const PlantState& state) const noexcept;

 private:
  double motor_torque(const PlantCommand& command, const PlantState& state) noexcept {
    if (!command.is_powered) return switched_off();
    return condition_.torque_constant_factor *
           (electrical_
                ? electrical_torque(command.current_A, state)
                : motor_.step(command.current_A, state.rotor_angle_rad, state.rotor_speed_rad_s));
  }
  double electrical_torque(double wanted_A, const PlantState& state) noexcept;
  double switched_off() noexcept;
  StageTorques step_second(const PlantState& state) noexcept {
    const StageMotion motion{state.middle_angle_rad, state.middle_speed_rad_s,
                             state.joint_angle_rad, state.joint_speed_rad_s};
    const StageTorques torques =
        detail::dispatch(second_, [&](auto& stage) { return step_stage(stage, motion); });
    return is_sound_ ? torques : with_condition(torques, motion);
  }
  [[nodiscard]] StageTorques with_condition(StageTorques torques,
                                            const StageMotion& motion) const noexcept;
  void move_elastic(bool is_held, const PlantTorques& torques, PlantState& state) const noexcept;
  void move_rigid(bool is_held, PlantTorques& torques, PlantState& state) const noexcept;
  void align_rotor(PlantState& state) const noexcept;

  PlantParameters parameters_;
  bool is_rigid_;
  bool is_sound_ = true;  ///< no part of the condition is about the second stage
  double ratio_;          ///< N of the first stage
  double middle_inertia_kg_m2_;
  double dt_s_ = 0.0;
  Motor motor_;
  LuGreFriction rotor_friction_;
  FirstStage first_;
  LuGreFriction middle_friction_;
  SecondStage second_;
  LuGreFriction bearing_;
  PlantCondition condition_;
  std::optional<ElectricalDrive> electrical_;
  std::optional<Brake> brake_;
};

inline void DriveTrain::find_torques(const PlantCommand& command, const PlantState& state,
                                     PlantTorques& torques) noexcept {
  const PlantState& s = state;
  PlantTorques& t = torques;
  t.motor_Nm = motor_torque(command, s);
  const StageTorques second = step_second(s);
  t.second_Nm = second.output_Nm;
  t.second_on_middle_Nm = second.input_Nm;
  if (!is_rigid_) {
    const StageMotion motion{s.rotor_angle_rad, s.rotor_speed_rad_s, s.middle_angle_rad,
                             s.middle_speed_rad_s};
    const StageTorques first =
        detail::dispatch(first_, [&](auto& stage) { return step_stage(stage, motion); });
    t.first_Nm = first.output_Nm;
    t.first_on_rotor_Nm = first.input_Nm;
  }
  t.rotor_friction_Nm =
      condition_.friction_factor * rotor_friction_.step(s.rotor_speed_rad_s, t.first_Nm, dt_s_);
  t.middle_friction_Nm =
      condition_.friction_factor * middle_friction_.step(s.middle_speed_rad_s, t.second_Nm, dt_s_);
  if (brake_) t.brake_Nm = brake_->step(command.brake_V, s.rotor_speed_rad_s, dt_s_);
  t.bearing_Nm = bearing_.step(s.joint_speed_rad_s, 0.0, dt_s_);
  t.joint_Nm = t.second_Nm - t.bearing_Nm;
}

inline void DriveTrain::move(const PlantCommand& command, PlantTorques& torques,
                             PlantState& state) const noexcept {
  if (is_rigid_) {
    move_rigid(command.is_motor_held, torques, state);
  } else {
    move_elastic(command.is_motor_held, torques, state);
  }
}

inline void DriveTrain::move_elastic(bool is_held, const PlantTorques& torques,
                                     PlantState& state) const noexcept {
  const PlantTorques& t = torques;
  const double rotor_Nm = t.motor_Nm - t.rotor_friction_Nm - t.brake_Nm - t.first_on_rotor_Nm;
  const double middle_Nm = t.first_Nm - t.middle_friction_Nm - t.second_on_middle_Nm;
  state.rotor_speed_rad_s =
      is_held ? 0.0 : state.rotor_speed_rad_s + dt_s_ * rotor_Nm / parameters_.rotor_inertia_kg_m2;
  state.middle_speed_rad_s += dt_s_ * middle_Nm / middle_inertia_kg_m2_;
  state.rotor_angle_rad += dt_s_ * state.rotor_speed_rad_s;
  state.middle_angle_rad += dt_s_ * state.middle_speed_rad_s;
}

inline void DriveTrain::move_rigid(bool is_held, PlantTorques& torques,
                                   PlantState& state) const noexcept {
  PlantTorques& t = torques;
  const double resistance_Nm = t.middle_friction_Nm + t.second_on_middle_Nm;
  const double drive_Nm = ratio_ * (t.motor_Nm - t.rotor_friction_Nm - t.brake_Nm);
  const double acceleration_rad_s2 =
      is_held ? 0.0 : (drive_Nm - resistance_Nm) / middle_inertia_kg_m2_;
  t.first_Nm = parameters_.middle_inertia_kg_m2 * acceleration_rad_s2 + resistance_Nm;
  t.first_on_rotor_Nm = t.first_Nm / ratio_;
  state.middle_speed_rad_s = is_held ? 0.0 : state.middle_speed_rad_s + dt_s_ * acceleration_rad_s2;
  state.middle_angle_rad += dt_s_ * state.middle_speed_rad_s;
  align_rotor(state);
}

inline void DriveTrain::align_rotor(PlantState& state) const noexcept {
  state.rotor_angle_rad = ratio_ * state.middle_angle_rad;
  state.rotor_speed_rad_s = ratio_ * state.middle_speed_rad_s;
}

}  // namespace torsio
