#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "sim/plant/drive_train.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The load of the joint.
struct Load {
  double inertia_kg_m2 = 0.0;       ///< added to that of the joint
  double gravity_Nm = 0.0;          ///< m g l cos(inclination): resists with gravity_Nm sin(q)
  double external_torque_Nm = 0.0;  ///< on the joint, positive along its angle
  bool is_locked = false;           ///< the joint is clamped
  /// An obstacle that pushes back with k (q - angle) + d ω, never pulls, beyond this angle.
  double wall_angle_rad = std::numeric_limits<double>::infinity();
  double wall_stiffness_Nm_rad = 0.0;
  double wall_damping_Nms_rad = 0.0;
};

/// A mass on a lever whose plane of motion is inclined by `inclination_rad` from the vertical.
/// @throws Error if mass or length is negative or not finite.
[[nodiscard]] Load lever(double mass_kg, double length_m, double inclination_rad = 0.0);

/// Any of the actuators: a drive train with its joint, a chain of three bodies and two stages.
///
///     J_r ω̇_r = τ_motor − τ_rf − τ_brake − τ₁ x₁′
///     J_m ω̇_m = τ₁ − τ_mf − τ₂ x₂′
///     J_j ω̇_j = τ₂ − τ_bearing − d ω_j − m g l cos(incl) sin q + τ_ext − τ_wall
///
/// xᵢ is the transmitted angle of a stage and xᵢ′ its slope (`DriveTrain`). A series-elastic actuator is rotor, gear, its output, spring, joint; one with a torsion tube
/// before its gear is rotor, tube, wave generator, gear, joint.
///
/// Semi-implicit Euler (speeds, then positions); the current, the friction bristles and the
/// viscoelastic branches are solved exactly; order current, second stage, first stage, friction,
/// speeds, positions. Source: specification 4.2 to 4.6.
class Plant {
 public:
  static constexpr double kDefaultStep_s = 1e-4;
  static constexpr std::size_t kWorkPorts = 12;

  /// @param longest_step_s a longer step is divided into equal ones; none: `step_limit`, but at
  /// most `kDefaultStep_s`
  /// @throws Error if an inertia is not positive, or the step is too long for the stiffest mode or
  /// the strongest damping (the message names which, and the limit).
  explicit Plant(const PlantParameters& parameters, double longest_step_s = 0.0);

  /// The longest step [s] that these parts allow: a quarter radian of the stiffest mode, with all
  /// friction sticking under the rated torque, and half a time constant of any body under its
  /// viscous terms, which are taken explicitly.
  [[nodiscard]] static double step_limit(const PlantParameters& parameters);
  /// The stiffest stop [Nm/rad] that such steps follow: half a radian of the mode of the two bodies
  /// that it throws against each other.
  [[nodiscard]] static double stiffest_stop(const PlantParameters& parameters, double step_s);

  /// At rest at this joint angle, the stages and the motor current carrying the load, all friction
  /// relaxed.
  /// @returns Fault::input_not_finite, and the plant stays as it is, if angle or load are not
  /// finite or have no finite rest
  Fault reset(double joint_angle_rad = 0.0, const Load& load = {}) noexcept;
  /// In any state, without current, all friction relaxed.
  /// @returns Fault::input_not_finite, and the plant stays as it is, if it is not finite
  Fault reset(const PlantState& state) noexcept;

  /// Wear and failures from now on; `reset` leaves them.
  /// @returns Fault::input_not_finite, and the condition stays as it is, if a factor is outside 0
  /// to 1000, the stop's twist negative, or its stiffness negative or above `stiffest_stop`
  Fault set_condition(const PlantCondition& condition) noexcept {
    return drive_.set_condition(condition, stiffest_stop_Nm_rad_);
  }
  [[nodiscard]] const PlantCondition& condition() const noexcept { return drive_.condition(); }

  /// From now on the motor is this one, with inverter and current control, instead of the lag of
  /// `Motor`; without current until `reset`. @throws Error as `ElectricalDrive`.
  void use(const ElectricalDrive::Parameters& electrical) { drive_.use(electrical); }
  /// @returns null unless `use` was called
  [[nodiscard]] const ElectricalDrive* electrical() const noexcept { return drive_.electrical(); }

  /// From now on there is a brake on the rotor, closed. @throws Error as `Brake`, or if the steps are
  /// too long for its bristle.
  void use(const Brake::Parameters& brake) { drive_.use(brake, longest_step_s_); }
  /// @returns null without a brake
  [[nodiscard]] const Brake* brake() const noexcept { return drive_.brake(); }
  /// The brake is open (closed) now, for longer than its delays; without effect if there is none.
  void set_brake(bool is_closed) noexcept { drive_.set_brake(is_closed); }

  /// Advances the plant. A value that is not finite, a negative inertia, a wall whose stiffness or
  /// damping is negative or too large for the steps (half a radian of its mode with the joint, half
  /// a time constant), or a dt that is not positive or longer than 10^6 of the longest steps is
  /// `Fault::input_not_finite`, and nothing moves. If finite input ends in a state that is not
  /// finite, that is `Fault::model_not_finite`, and the plant is back at rest at angle 0.
  [[nodiscard]] Fault step(const PlantCommand& command, const Load& load,
                           double dt_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] const PlantParameters& parameters() const noexcept { return drive_.parameters(); }
  [[nodiscard]] double longest_step() const noexcept { return longest_step_s_; }  ///< [s]
  [[nodiscard]] const PlantState& state() const noexcept { return state_; }
  [[nodiscard]] const PlantTorques& torques() const noexcept { return torques_; }
  [[nodiscard]] double current() const noexcept {
    return drive_.current();
  }  ///< [A], that makes torque
  [[nodiscard]] const FirstStage& first() const noexcept { return drive_.first(); }
  [[nodiscard]] const SecondStage& second() const noexcept { return drive_.second(); }
  [[nodiscard]] const LuGreFriction& rotor_friction() const noexcept {
    return drive_.rotor_friction();
  }
  [[nodiscard]] const LuGreFriction& middle_friction() const noexcept {
    return drive_.middle_friction();
  }
  [[nodiscard]] const LuGreFriction& bearing() const noexcept { return drive_.bearing(); }

  /// @returns twist [rad] and hysteretic torque [Nm] of a stage in the last step
  [[nodiscard]] double first_twist() const noexcept { return drive_.first_twist(state_); }
  [[nodiscard]] double second_twist() const noexcept { return drive_.second_twist(state_); }
  [[nodiscard]] double first_friction_torque() const noexcept {
    return drive_.first_friction_torque();
  }
  [[nodiscard]] double second_friction_torque() const noexcept {
    return drive_.second_friction_torque();
  }

  /// For the energy audit: every port through which work flows, and what is stored. Without
  /// meaning once the condition has changed.
  [[nodiscard]] std::array<WorkPort, kWorkPorts> work_ports(const Load& load) const noexcept;
  [[nodiscard]] StoredEnergy stored_energy(const Load& load) const noexcept;

 private:
  void set_period(double dt_s) noexcept;
  void small_step(const PlantCommand& command, const Load& load) noexcept;

  DriveTrain drive_;
  PlantState state_;
  PlantTorques torques_;
  double longest_step_s_;
  double stiffest_stop_Nm_rad_;
  double asked_dt_s_ = 0.0;
  double dt_s_ = 0.0;
  std::size_t small_steps_ = 1;
};

}  // namespace torsio
