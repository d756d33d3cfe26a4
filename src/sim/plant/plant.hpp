#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
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

/// Wear and faults of a plant while it runs; the defaults are a plant without faults.
struct PlantCondition {
  double friction_factor = 1.0;         ///< factor of the friction at rotor and middle body
  double torque_constant_factor = 1.0;  ///< factor of k_t that the current loop does not include
  double second_stage_factor = 1.0;     ///< factor of the second stage's torque; 0: broken
  /// Where the second stage's twist meets a hard stop (a bottomed spring).
  double stop_twist_rad = std::numeric_limits<double>::infinity();
  double stop_stiffness_Nm_rad = 0.0;
};

/// Between rotor and middle body, and between middle body and joint.
using FirstStage = std::variant<Gear, SlipClutch>;
using SecondStage = std::variant<Spring, ElastomerCoupling, RubberSpring, Gear>;

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

struct PlantState {
  double rotor_angle_rad = 0.0;
  double rotor_speed_rad_s = 0.0;
  double middle_angle_rad = 0.0;
  double middle_speed_rad_s = 0.0;
  double joint_angle_rad = 0.0;
  double joint_speed_rad_s = 0.0;
};

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

/// What a stage does to the bodies at its two ends.
struct StageTorques {
  double output_Nm = 0.0;  ///< on the output body
  double input_Nm = 0.0;   ///< against the input body
};

/// A torque and the speed at which it works, for the energy audit.
struct WorkPort {
  enum class Kind {
    input,       ///< into the plant
    loss,        ///< out of it, as heat
    hysteretic,  ///< into elements that keep a part of it and turn the rest to heat
  };
  Kind kind = Kind::loss;
  double torque_Nm = 0.0;        ///< over the last step
  double speed_rad_s = 0.0;      ///< after it
  double viscous_Nms_rad = 0.0;  ///< adds this times the speed before the step to the torque
  double stored_J = 0.0;         ///< what a hysteretic element keeps of its work
};

/// What is stored in a plant and its load.
struct StoredEnergy {
  double all_J = 0.0;
  double hysteretic_J =
      0.0;  ///< the share in bristles, slip and viscoelastic elements and the obstacle
};

/// Any of the actuators: a chain of three bodies and two stages.
///
///     J_r ω̇_r = τ_motor − τ_rf − τ₁ x₁′
///     J_m ω̇_m = τ₁ − τ_mf − τ₂ x₂′
///     J_j ω̇_j = τ₂ − τ_bearing − d ω_j − m g l cos(incl) sin q + τ_ext − τ_wall
///
/// xᵢ is the transmitted angle of a stage and xᵢ′ its slope: θ/N + ε(θ) for a gear, θ for a spring.
/// A series-elastic actuator is rotor, gear, its output, spring, joint; one with a torsion tube
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
  Fault set_condition(const PlantCondition& condition) noexcept;
  [[nodiscard]] const PlantCondition& condition() const noexcept { return condition_; }

  /// From now on the motor is this one, with inverter and current control, instead of the lag of
  /// `Motor`; without current until `reset`. @throws Error as `ElectricalDrive`.
  void use(const ElectricalDrive::Parameters& electrical) { electrical_.emplace(electrical); }
  /// @returns null unless `use` was called
  [[nodiscard]] const ElectricalDrive* electrical() const noexcept {
    return electrical_ ? &*electrical_ : nullptr;
  }

  /// From now on there is a brake on the rotor, closed. @throws Error as `Brake`, or if the steps are
  /// too long for its bristle.
  void use(const Brake::Parameters& brake);
  /// @returns null without a brake
  [[nodiscard]] const Brake* brake() const noexcept { return brake_ ? &*brake_ : nullptr; }
  /// The brake is open (closed) now, for longer than its delays; without effect if there is none.
  void set_brake(bool is_closed) noexcept {
    if (brake_) brake_->reset(is_closed);
  }

  /// Advances the plant. A value that is not finite, a negative inertia, a wall whose stiffness or
  /// damping is negative or too large for the steps (half a radian of its mode with the joint, half
  /// a time constant), or a dt that is not positive or longer than 10^6 of the longest steps is
  /// `Fault::input_not_finite`, and nothing moves. If finite input ends in a state that is not
  /// finite, that is `Fault::model_not_finite`, and the plant is back at rest at angle 0.
  [[nodiscard]] Fault step(const PlantCommand& command, const Load& load,
                           double dt_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] const PlantParameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] double longest_step() const noexcept { return longest_step_s_; }  ///< [s]
  [[nodiscard]] const PlantState& state() const noexcept { return state_; }
  [[nodiscard]] const PlantTorques& torques() const noexcept { return torques_; }
  [[nodiscard]] double current() const noexcept {
    return electrical_ ? electrical_->current() : motor_.current();
  }  ///< [A], that makes torque
  [[nodiscard]] const FirstStage& first() const noexcept { return first_; }
  [[nodiscard]] const SecondStage& second() const noexcept { return second_; }
  [[nodiscard]] const LuGreFriction& rotor_friction() const noexcept { return rotor_friction_; }
  [[nodiscard]] const LuGreFriction& middle_friction() const noexcept { return middle_friction_; }
  [[nodiscard]] const LuGreFriction& bearing() const noexcept { return bearing_; }

  /// @returns twist [rad] and hysteretic torque [Nm] of a stage in the last step
  [[nodiscard]] double first_twist() const noexcept;
  [[nodiscard]] double second_twist() const noexcept;
  [[nodiscard]] double first_friction_torque() const noexcept;
  [[nodiscard]] double second_friction_torque() const noexcept;

  /// For the energy audit: every port through which work flows, and what is stored. Without
  /// meaning once the condition has changed.
  [[nodiscard]] std::array<WorkPort, kWorkPorts> work_ports(const Load& load) const noexcept;
  [[nodiscard]] StoredEnergy stored_energy(const Load& load) const noexcept;

 private:
  void set_period(double dt_s) noexcept;
  void start(const PlantState& state) noexcept;
  void small_step(const PlantCommand& command, const Load& load) noexcept;
  double motor_torque(double wanted_A) noexcept;
  double switched_off() noexcept;
  StageTorques step_second() noexcept;

  PlantParameters parameters_;
  Motor motor_;
  std::optional<ElectricalDrive> electrical_;
  LuGreFriction rotor_friction_;
  FirstStage first_;
  LuGreFriction middle_friction_;
  SecondStage second_;
  LuGreFriction bearing_;
  PlantState state_;
  PlantTorques torques_;
  PlantCondition condition_;
  bool is_sound_ = true;  ///< no part of the condition is about the second stage
  double longest_step_s_;
  double stiffest_stop_Nm_rad_;
  double asked_dt_s_ = 0.0;
  double dt_s_ = 0.0;
  std::size_t small_steps_ = 1;
  std::optional<Brake> brake_;
};

}  // namespace torsio
