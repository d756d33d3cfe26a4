#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "sim/arm/plate_contact.hpp"
#include "sim/plant/drive_train.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/arm/arm_model.hpp"
#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// What acts on an arm from outside.
struct ArmLoad {
  std::array<double, kMaxArmJoints> torque_Nm = {};  ///< on each joint, positive along its angle
  Vector3 force_N = {};                              ///< on the flange, in the frame of the base
  Vector3 moment_Nm = {};                            ///< on the flange, in the frame of the base
  std::array<bool, kMaxArmJoints> is_locked = {};    ///< the joint is clamped
};

/// A serial arm whose joints are moved by series-elastic actuators, each a `DriveTrain`:
///
///     M(q) q̈ = τ_second − τ_bearing − d q̇ + τ_ext + J(q)ᵀ f − c(q, q̇) − g(q)
///
/// f also has the force of a plate that the flange touches, in every step of the integration.
///
/// A clamped joint keeps q̇ᵢ = 0; its row and column are left out. The links of the model replace
/// `PlantParameters::joint_inertia_kg_m2`, which is not used; the masses of the motors are in the
/// links, the inertias of their rotors about their own axes in the drive trains. That the rotors
/// also turn with their links is neglected, as in most models of geared arms (Spong 1987).
///
/// Semi-implicit Euler as in `Plant`: all torques from the state before the step, then
/// accelerations, speeds, positions.
class ArmPlant {
 public:
  static constexpr double kDefaultStep_s = 1e-4;
  /// Per joint those of its drive train, what acts on it from outside, viscous friction.
  static constexpr std::size_t kJointPorts = DriveTrain::kWorkPorts + 2;
  static constexpr std::size_t kWorkPorts = kJointPorts * kMaxArmJoints;

  /// All joints at rest at angle 0, carrying gravity.
  /// @param drives one per joint, in their order
  /// @param form of the first stage of all drives
  /// @param longest_step_s a longer step is divided into equal ones; none: `step_limit`, but at
  /// most `kDefaultStep_s`
  /// @throws Error if the number of drives is not that of the joints, the arm or a drive is
  /// impossible, or the step is too long for the stiffest mode or the strongest damping (the message
  /// names which, and the limit).
  ArmPlant(const ArmModel& arm, std::span<const PlantParameters> drives, FirstStageForm form,
           double longest_step_s = 0.0);

  /// The longest step [s]: a quarter radian of the stiffest mode of arm and drives together, and half
  /// a time constant of their viscous terms, over random poses (`arm_step_limits`).
  [[nodiscard]] static double step_limit(const ArmModel& arm,
                                         std::span<const PlantParameters> drives,
                                         FirstStageForm form);

  /// At rest at these joint angles, with springs, gears and motor currents carrying gravity and load
  /// (nothing at a clamped joint), all friction relaxed.
  /// @returns Fault::input_not_finite, and the arm stays as it is, if angles or load are not finite;
  /// Fault::input_count_wrong if there is not one angle per joint
  Fault reset(std::span<const double> joint_angle_rad, const ArmLoad& load = {}) noexcept;
  /// In any state, without current, all friction relaxed. Faults as above. With a rigid first stage
  /// the rotors follow from the middle bodies.
  Fault reset(std::span<const PlantState> states) noexcept;

  // Everywhere `joint` < `size()` is a precondition that nothing checks.

  /// As Plant's.
  Fault set_condition(std::size_t joint, const PlantCondition& condition) noexcept;
  /// The stiffest stop [Nm/rad] of a joint's spring that its steps follow.
  [[nodiscard]] double stiffest_stop(std::size_t joint) const noexcept {
    return joints_[joint].stiffest_stop_Nm_rad;
  }
  void use(std::size_t joint, const ElectricalDrive::Parameters& electrical) {
    joints_[joint].drive.use(electrical);
  }
  void use(std::size_t joint, const Brake::Parameters& brake) {
    joints_[joint].drive.use(brake, longest_step_s_);
  }
  /// From now on the flange may hit this plate, whose place is in the frame of the base; none: it is removed.
  /// @throws Error if its normal is not of length 1, or stiffness, damping or mass are not in the range of `PlateContact`.
  void use(const std::optional<ArmPlate>& plate);
  [[nodiscard]] PlateContact* plate() noexcept { return plate_ ? &*plate_ : nullptr; }
  [[nodiscard]] const PlateContact* plate() const noexcept { return plate_ ? &*plate_ : nullptr; }
  void set_brake(std::size_t joint, bool is_closed) noexcept {
    joints_[joint].drive.set_brake(is_closed);
  }

  /// Advances the arm. A value that is not finite, or a dt that is not positive or above 10^6 of the
  /// longest steps, is `Fault::input_not_finite`; a number of commands that is not that of the joints
  /// is `Fault::input_count_wrong`; and nothing moves. If finite input ends in a state that is not
  /// finite, that is `Fault::model_not_finite`, and the arm is back at rest at angles 0.
  [[nodiscard]] Fault step(std::span<const PlantCommand> commands, const ArmLoad& load,
                           double dt_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return joints_.size(); }
  [[nodiscard]] double longest_step() const noexcept { return longest_step_s_; }  ///< [s]
  [[nodiscard]] const ArmDynamics& dynamics() const noexcept { return dynamics_; }
  [[nodiscard]] const DriveTrain& drive(std::size_t joint) const noexcept {
    return joints_[joint].drive;
  }
  [[nodiscard]] const PlantState& state(std::size_t joint) const noexcept {
    return joints_[joint].state;
  }
  [[nodiscard]] const PlantTorques& torques(std::size_t joint) const noexcept {
    return joints_[joint].torques;
  }
  /// What acted on the joint from outside in the last step, τ_ext + J(q)ᵀ f with the plate's force [Nm].
  [[nodiscard]] double external_torque(std::size_t joint) const noexcept {
    return external_Nm_[joint];
  }
  [[nodiscard]] double current(std::size_t joint) const noexcept {
    return joints_[joint].drive.current();
  }  ///< [A]

  /// For the energy audit, as Plant's.
  [[nodiscard]] std::array<WorkPort, kWorkPorts> work_ports() const noexcept;
  [[nodiscard]] StoredEnergy stored_energy() const noexcept;

 private:
  struct Joint {
    DriveTrain drive;
    double viscous_Nms_rad;  ///< d
    double stiffest_stop_Nm_rad;
    PlantState state = {};
    PlantTorques torques = {};
  };

  void set_period(double dt_s) noexcept;
  void small_step(std::span<const PlantCommand> commands, const ArmLoad& load) noexcept;
  void accelerate(const ArmLoad& load, ArmDynamics::PerJoint& acceleration_rad_s2) noexcept;
  void find_external(std::span<const double> angle_rad, const ArmLoad& load,
                     ArmDynamics::PerJoint& external_Nm) const noexcept;
  void touch_plate(std::span<const double> angle_rad, std::span<const double> speed_rad_s) noexcept;
  void rest_at_zero() noexcept;

  ArmDynamics dynamics_;
  std::vector<Joint> joints_;
  ArmDynamics::PerJoint external_Nm_{};
  std::optional<PlateContact> plate_ = {};
  double longest_step_s_;
  double asked_dt_s_ = 0.0;
  double dt_s_ = 0.0;
  std::size_t small_steps_ = 1;
};

}  // namespace torsio
