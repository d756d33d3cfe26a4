#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/sim/arm/arm_run.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// What a program of moves is to determine.
enum class ExcitationGoal : std::uint8_t {
  payload,  ///< mass, centre and inertia of the payload
  links,    ///< the same of each link
  springs,  ///< the springs of all joints, by `calibrate_joints`
};

struct ExcitationSpec {
  ExcitationGoal goal = ExcitationGoal::payload;
  std::size_t moves = 12;
  std::size_t candidates = 40;  ///< random poses for each move, of which the best one is taken
  std::uint64_t seed = 1;
  double range_share = 0.85;     ///< share of each joint's range about its middle
  double lowest_height_m = 0.1;  ///< least height of joints and flange above the base
  double torque_share = 0.9;     ///< largest torque over the rating
};

struct ExcitingProgram {
  ArmProgram program;
  double duration_s = 0.0;
  double information = 0.0;  ///< log det (1 + Yᵀ Y) of all moves
  /// The ratio of the largest to the least singular value of the regressor for 1 kg, 0.1 kg m and 0.01 kg m2, joints
  /// weighted by their ratings, of the payload. NaN for another goal.
  double condition_number = 0.0;
  std::vector<double> largest_torque_Nm = {};  ///< one per joint
  std::vector<double> largest_speed_rad_s = {};
};

/// Moves from pose to pose that determine payload or links well. From each pose `candidates` random ones are drawn, and the move is
/// taken that adds most per second to log det (1 + Yᵀ Y): Y the regressor of the momentum equation of all moves so far, in units of
/// the prior and with the torque of each joint known to 2 % of its rating. The last move returns to the start, the first
/// pose within the limits that is drawn. Angles are whole tenths of a degree. Deterministic for a seed.
///
/// `springs`: each joint in turn is moved to the pose, of ten times as many, that changes its torque of gravity the most, so that
/// all springs are wound between their extremes.
///
/// Refused are poses and moves in which a joint or the flange is lower than `lowest_height_m` or within 0.15 m of the
/// base's axis above its first joint, or a torque is above `torque_share` of the rating. What surrounds the arm, and
/// collisions of its links, are not considered.
/// @throws Error if no move within these limits is found; UsageError if a setting is out of range; Cancelled.
[[nodiscard]] ExcitingProgram exciting_program(const ArmSetup& setup, const ExcitationSpec& spec,
                                               const Progress& progress = {});

/// The program as text of its YAML file. @throws UsageError for steps other than moves and holds.
[[nodiscard]] std::string program_yaml(const ArmProgram& program);

}  // namespace torsio
