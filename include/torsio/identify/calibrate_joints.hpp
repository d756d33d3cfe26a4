#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "torsio/data/recording.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// An arm that moved with a known weight on a base of known tilt.
struct CalibrationMotion {
  ArmSetup setup;  ///< its payload is the weight, its gravity that of the tilted base
  Recording recording;
};

/// What is assumed, each with one standard deviation.
struct CalibrationOptions {
  double weight_share = 0.001;   ///< share of the weight's mass
  double attachment_m = 0.0005;  ///< each coordinate of its centre
  double link_share = 0.01;      ///< share of each link's mass and inertia
  double link_com_m = 0.002;     ///< each coordinate of a link's centre
  /// Angles from which speed and acceleration are found, by a parabola without delay.
  double parabola_s = 0.06;
  double least_share = 0.2;  ///< share of the rating; less does not determine a spring
};

/// The training data of one joint.
struct CalibratedJoint {
  std::string name = {};
  std::string actuator = {};
  /// One per motion: the joint's angles and current as on a bench; `torque_Nm` is the torque that the links
  /// and the weight need, new at 125 Hz.
  std::vector<Recording> recordings = {};
  double largest_Nm = 0.0;         ///< the largest torque
  double largest_weight_Nm = 0.0;  ///< the largest torque of the known weight alone
  double rating_Nm = 0.0;
  double target_std_Nm = 0.0;  ///< RMS of the standard deviation of `torque_Nm`
  double weight_std_Nm = 0.0;  ///< the part of weight and attachment
  double links_std_Nm = 0.0;   ///< the part of the links
  bool is_determined = false;
  std::string reason = {};  ///< why not

  [[nodiscard]] double weight_share() const noexcept { return largest_weight_Nm / rating_Nm; }
};

/// The torque at each joint from the arm's dynamics with a known weight, in place of a load cell:
///
///     τ = M(q) q̈ + c(q, q̇) + g(q)
///
/// q̇ and q̈ are those of a parabola through the angles of 2 x 30 ms. A joint on which the weight causes at most
/// `least_share` of the rating is not determined: of its spring only the links' torques are known, whose masses are
/// not. The uncertainty of the target follows from those of the weight, its attachment and the links.
///
/// @throws Error if the motions are of different arms, a channel (`joint1_motor_angle_rad`, `joint1_gear_angle_rad`,
/// `joint1_joint_angle_rad`, `joint1_motor_current_A` of each joint) is missing or not finite, the arm does not move, a
/// recording is shorter than 2 s, or there is no weight; UsageError for an option out of range.
[[nodiscard]] std::vector<CalibratedJoint> calibrate_joints(
    std::span<const CalibrationMotion> motions, const CalibrationOptions& options = {});

}  // namespace torsio
