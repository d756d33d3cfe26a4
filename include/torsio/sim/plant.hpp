#pragma once

#include <cstddef>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/actuator/friction.hpp"
#include "torsio/actuator/gear.hpp"
#include "torsio/actuator/motor.hpp"
#include "torsio/actuator/spring.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// What drives the plant.
struct PlantCommand {
  double current_A = 0.0;      ///< wanted motor current
  bool is_motor_held = false;  ///< the rotor is clamped; the current has no effect
};

/// What hangs on the joint.
struct Load {
  double inertia_kg_m2 = 0.0;       ///< added to the output's own
  double gravity_Nm = 0.0;          ///< m g l cos(inclination): resists with gravity_Nm sin(q)
  double external_torque_Nm = 0.0;  ///< on the joint, positive along its angle
  bool is_locked = false;           ///< the joint is clamped
};

/// A mass on a lever whose plane of motion is inclined by `inclination_rad` from the vertical.
/// @throws Error if mass or length is negative or not finite.
[[nodiscard]] Load lever(double mass_kg, double length_m, double inclination_rad = 0.0);

/// The parts of one actuator.
struct PlantParameters {
  Motor::Parameters motor;
  LuGreFriction::Parameters motor_friction;  ///< rotor side
  Gear::Parameters gear;
  Spring::Parameters spring;
  LuGreFriction::Parameters bearing;   ///< of the joint, before the load cell
  double joint_viscous_Nms_rad = 0.0;  ///< d, behind the load cell
  double rotor_inertia_kg_m2 = 0.0;
  double gear_inertia_kg_m2 = 0.0;
  double output_inertia_kg_m2 = 0.0;
  double rated_torque_Nm = 0.0;  ///< up to which the stiffest mode is looked for
};
[[nodiscard]] PlantParameters plant_parameters(const DataSheet& sheet);

struct PlantState {
  double rotor_angle_rad = 0.0;
  double rotor_speed_rad_s = 0.0;
  double gear_angle_rad = 0.0;
  double gear_speed_rad_s = 0.0;
  double joint_angle_rad = 0.0;
  double joint_speed_rad_s = 0.0;
};

/// The torques of the last step.
struct PlantTorques {
  double motor_Nm = 0.0;           ///< on the rotor, ripple included
  double motor_friction_Nm = 0.0;  ///< against the rotor
  double gear_Nm = 0.0;            ///< on the gear's output
  double gear_on_rotor_Nm = 0.0;   ///< against the rotor
  double spring_Nm = 0.0;          ///< of the spring on the joint
  double bearing_Nm = 0.0;         ///< dry friction of the joint, against it
  double joint_Nm = 0.0;           ///< what a load cell between joint and lever feels
};

/// A motor, a strain-wave gear, a series spring and a joint with its load:
///
///     J_m ω̇_m = τ_motor − τ_friction − τ_h (1/N + ε′)
///     J_g ω̇_g = τ_h − τ_s
///     J_l ω̇_l = τ_s − τ_bearing − d ω_l − m g l cos(incl) sin q_l + τ_ext
///
/// Semi-implicit Euler (speeds, then positions), the current and the friction bristles solved
/// exactly; order current, spring, gear, friction, speeds, positions. Source: SPEC sections 4.2 and
/// 4.6.
class Plant {
 public:
  /// @param longest_step_s a longer step is divided into equal ones
  /// @throws Error if an inertia is not positive, or the step is too long for the stiffest mode
  /// (the message names the limit).
  explicit Plant(const PlantParameters& parameters, double longest_step_s = 1e-4);

  /// The longest step [s] that these parts allow: a quarter radian of the stiffest mode, with all
  /// friction sticking under the rated torque.
  [[nodiscard]] static double step_limit(const PlantParameters& parameters);

  /// At rest at this joint angle, the spring and the motor current carrying the load, all friction
  /// relaxed.
  void reset(double joint_angle_rad = 0.0, const Load& load = {}) noexcept;
  /// In any state, without current, all friction relaxed.
  void reset(const PlantState& state) noexcept;

  /// Advances the plant. A value that is not finite, a negative inertia or a dt that is not
  /// positive or longer than 10^6 of the longest steps is `Fault::input_not_finite`, and nothing
  /// moves.
  [[nodiscard]] Fault step(const PlantCommand& command, const Load& load,
                           double dt_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] const PlantParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] const PlantState& state() const noexcept { return state_; }
  [[nodiscard]] const PlantTorques& torques() const noexcept { return torques_; }
  [[nodiscard]] double current() const noexcept { return motor_.current(); }  ///< [A]
  [[nodiscard]] const Spring& spring() const noexcept { return spring_; }
  [[nodiscard]] const Gear& gear() const noexcept { return gear_; }

 private:
  void set_period(double dt_s) noexcept;
  void small_step(const PlantCommand& command, const Load& load) noexcept;

  PlantParameters parameters_;
  Motor motor_;
  LuGreFriction motor_friction_;
  Gear gear_;
  Spring spring_;
  LuGreFriction bearing_;
  PlantState state_;
  PlantTorques torques_;
  double longest_step_s_;
  double asked_dt_s_ = 0.0;
  double dt_s_ = 0.0;
  std::size_t small_steps_ = 1;
};

}  // namespace torsio
