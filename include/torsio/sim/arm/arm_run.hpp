#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/sim/arm/arm_setup.hpp"
#include "torsio/sim/faults/fault_schedule.hpp"

namespace torsio {

/// A flat plate that the flange of a simulated arm may hit. It carries no force along its face, and the arm's other
/// parts pass through it.
struct ArmPlate {
  bool is_from_flange = true;  ///< `at_m` is measured from where the flange is when the step begins
  Vector3 at_m = {};           ///< a point of its face, along the axes of the base
  Vector3 normal = {0.0, 0.0, 1.0};  ///< out of its face, in the frame of the base, of length 1
  double stiffness_N_m = 75e3;
  double damping_Ns_m = 0.0;
  double mass_kg =
      0.0;  ///< 0: clamped; else it moves along its normal, without weight and friction
};

/// What an arm does in one step of its program.
enum class ArmTask : std::uint8_t {
  move,       ///< to an angle of each joint, by `ArmMove`
  follow,     ///< a sampled trajectory
  hold,       ///< the angles at which it is
  guide,      ///< hand guiding
  impedance,  ///< a spring and damper at each joint, from where it is
  cartesian,  ///< springs and dampers at the flange, from where it is
};

/// A force or torque from outside, for a part of a step.
struct ArmPush {
  double start_s = 0.0;  ///< since the step began
  double duration_s = 0.0;
  Vector3 force_N = {};                ///< on the flange, in the frame of the base
  Vector3 moment_Nm = {};              ///< on the flange, in the frame of the base
  std::vector<double> torque_Nm = {};  ///< on each joint; empty: none
};

struct ArmStep {
  ArmTask task = ArmTask::hold;
  double duration_s = 0.0;                         ///< all but move and follow
  std::vector<double> to_rad = {};                 ///< move: one angle per joint
  std::vector<std::vector<double>> path_rad = {};  ///< follow: one angle per joint and tick
  std::vector<double> stiffness_Nm_rad = {};       ///< impedance: one per joint
  std::vector<double> damping_Nms_rad = {};        ///< impedance: one per joint
  std::vector<ArmPush> pushes = {};
  /// From the beginning of the step to the end of the program, or to the next one.
  std::optional<ArmPlate> plate = {};
};

/// Plain data: what an arm does, one step after the other.
struct ArmProgram {
  std::vector<double> start_rad;
  std::vector<ArmStep> steps = {};
  ContactReaction reaction = ContactReaction::none;
  CartesianImpedance::Settings cartesian = {.stiffness = {800.0, 800.0, 800.0, 40.0, 40.0, 40.0}};
  std::vector<std::string> files = {};  ///< trajectories that were read
};

/// Reads a program for this arm; docs/robot/arm.md has the format.
///
///     start: [0deg, -60deg, 100deg, 0deg, 40deg, 0deg]
///     program:
///       - move: [30deg, -40deg, 80deg, 20deg, 50deg, 0deg]
///       - hold: 1s
///       - guide: 3s
///         push: {force: [0N, 20N, 0N], at: 0.5s, for: 1s}
///       - impedance: 2s
///         stiffness_Nm_rad: [300, 300, 120, 30, 30, 10]
///         damping_Nms_rad: [30, 30, 12, 2, 2, 1]
///       - cartesian: 3s
///       - follow: trajectory.csv
///       - move: [30deg, -40deg, 80deg, 20deg, 50deg, 0deg]
///         plate: {from_flange: [50mm, 0mm, 0mm], normal: [-1, 0, 0], stiffness_N_m: 75000, mass: 4.4kg}
///     contact: retract
///
/// `follow` takes channels `joint1_angle_rad`, ..., named as the joints of the arm.
/// @throws Error naming file, line, what was expected and found: an angle beyond the limits, a trajectory that is not
/// where the step before ended, is faster than a joint may move or crosses its limits (with the line of the file), a
/// Cartesian step that begins in a singular pose.
[[nodiscard]] ArmProgram read_arm_program(const std::string& path, const ArmSetup& setup,
                                          const Progress& progress = {});
/// Moves through a few poses, hand guiding and a push against the flange: for `arm6_setup`.
[[nodiscard]] ArmProgram arm6_program();

/// @throws Error as `read_arm_program`, that names the step. A plate is refused as by `ArmPlant`.
void require_possible(const ArmProgram& program, const ArmSetup& setup);

struct ArmRunSpec {
  ArmProgram program;
  std::vector<FaultSchedule> faults = {};                  ///< one per joint; empty: none
  std::optional<ContactDetector::Settings> contacts = {};  ///< none: contacts are not looked for
  std::uint64_t seed = 1;
  bool has_gear_stage = true;  ///< else rotor and gear output turn together: half the cost
  bool with_truth = false;     ///< also what no sensor measures
};

/// How one joint did.
struct ArmJointScore {
  std::string joint;
  std::string actuator;
  /// The RMSE of the link in moves and holds; none: there were none after the first 0.5 s.
  std::optional<double> position_rmse_rad = {};
  /// The RMSE of the torque on the link; none: the run ended within the first 0.5 s.
  std::optional<double> torque_rmse_Nm = {};
  std::optional<double> external_rmse_Nm = {};
  double largest_torque_Nm = 0.0;
  double largest_share = 0.0;  ///< largest torque over the rating
  double limited_s = 0.0;      ///< how long a limit was in effect
};

/// A contact that the arm's controller found.
struct ArmContact {
  double found_s = 0.0;
  std::string joint = {};
  ContactReaction reaction = ContactReaction::none;
  std::optional<double> latency_s = {};  ///< since it truly began; none: a false alarm
};

/// The force between flange and plate.
struct ArmImpact {
  double touched_s = 0.0;     ///< when
  double first_peak_N = 0.0;  ///< largest in the first 40 ms
  double peak_N = 0.0;
  double peak_after_s = 0.0;
  std::optional<double> largest_late_N = {};  ///< largest later than 80 ms after the touch
  std::optional<double> rest_N = {};          ///< 0.5 s after the touch
};

/// What an arm did.
struct ArmRun {
  Recording record;                    ///< all joints on one clock: joint1_motor_angle_rad, ...
  std::vector<Recording> joints = {};  ///< each with the channels of a bench, for `fit` and `check`
  std::vector<ArmJointScore> scores = {};
  double duration_s = 0.0;
  ArmStopCause cause = ArmStopCause::none;
  std::string stopped_joint = {};        ///< where it was found
  std::string stop_reason = {};          ///< what was found, in words
  double stopped_s = 0.0;                ///< when; 0: not stopped
  std::optional<double> at_rest_s = {};  ///< from the stop until all drives were at rest
  double largest_drop_m = 0.0;           ///< how far the flange moved after the stop
  /// How long references were refused, and the arm held: they began too far from the measured angles.
  double refused_s = 0.0;
  double refused_from_s = 0.0;  ///< when the first one was refused
  std::vector<ArmContact> contacts = {};
  std::optional<ArmImpact> impact = {};  ///< none: the flange touched no plate

  /// @returns the name that a channel of a joint has in `record`
  [[nodiscard]] std::string joint_channel(std::size_t joint, std::string_view channel) const;
};

/// Runs the program on the simulated arm with its sensors: the brakes are opened first, and a fault ends the run with a
/// stop. A reaction to a contact ends the program; the run continues for one second. @throws Error if a part refuses its settings, UsageError as `FaultInjector`, Cancelled.
[[nodiscard]] ArmRun run_arm(const ArmSetup& setup, const ArmRunSpec& spec,
                             const Progress& progress = {});

/// The enumerators' own spelling.
[[nodiscard]] std::string_view name(ArmTask task) noexcept;

}  // namespace torsio
