#pragma once

#include <string>
#include <vector>

#include "torsio/arm/arm_model.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// How an arm moved, and the torques that its joints' models estimated: plain data.
struct ArmMotion {
  std::string name = {};  ///< for messages
  double sample_rate_Hz = 0.0;
  std::vector<std::vector<double>> angle_rad = {};  ///< angles of the links, one list per joint
  std::vector<std::vector<double>> torque_Nm = {};  ///< torques on the links, one list per joint
};

/// The motion of a recording with channels `joint1_joint_angle_rad` and `joint1_estimated_torque_Nm`
/// for each joint of the arm, as `torsio arm -o` writes them.
/// @throws Error naming recording, channel and time if a channel is missing, a value is not finite, or
/// an angle is outside the limits of the joint: the recording is of another arm.
[[nodiscard]] ArmMotion arm_motion(const Recording& recording, const ArmModel& arm);

/// @throws Error if the motion does not have as many joints as the arm, lists of unequal length, a
/// sample rate of 50 Hz to 100 kHz, or if no joint moves by more than 0.01 rad.
void require_motion(const ArmMotion& motion, const ArmModel& arm);

/// A number that a motion determines, or why it does not.
struct IdentifiedQuantity {
  double value = kNotMeasured;
  double standard_error = kNotMeasured;
  bool is_determined = false;
  std::string reason = {};  ///< why it is not determined
};

/// What was found at one joint besides the masses.
struct IdentifiedJoint {
  std::string name = {};
  IdentifiedQuantity dry_Nm = {};           ///< dry friction of the bearing
  IdentifiedQuantity viscous_Nms_rad = {};  ///< viscous friction of the bearing
  double residual_Nm = 0.0;                 ///< RMS of the residual, means over a window
};

/// The data on which an identification rests.
struct IdentificationData {
  double duration_s = 0.0;
  double window_s = 0.0;
  double block_s = 0.0;  ///< length of a block of the jackknife
  std::size_t windows = 0;
  std::size_t blocks = 0;
};

}  // namespace torsio
