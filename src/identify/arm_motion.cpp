#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "sim/arm/joint_channels.hpp"
#include "torsio/core/error.hpp"
#include "torsio/identify/identification.hpp"

namespace torsio {
namespace {

constexpr double kBeyondLimits_rad = 0.1;  // a spring and an overshoot may move a link so far
constexpr double kStill_rad = 0.01;
constexpr double kSlowestRate_Hz = 50.0;
constexpr double kFastestRate_Hz = 1e5;

const std::vector<double>& finite_channel(const Recording& recording, const std::string& name,
                                          const ArmModel& arm) {
  if (!recording.has(name))
    throw Error(
        {.place = recording.name(),
         .expected = fmt::format("a channel '{}': angle of the link and estimated torque of "
                                 "each joint of {}",
                                 name, arm.name),
         .found = "none of that name",
         .advice = "Record with 'torsio arm -o', name the channels as the joints of the "
                   "arm's URDF, or check that this is the arm of the recording."});
  const std::vector<double>& values = recording.channel(name).values;
  for (std::size_t n = 0; n < values.size(); ++n)
    if (!std::isfinite(values[n]))
      throw Error(
          {.place = fmt::format("{}: {} at {:.3f} s", recording.name(), name, recording.time_s(n)),
           .expected = "a finite value",
           .found = fmt::format("{}", values[n]),
           .advice = "Cut the recording there."});
  return values;
}

}  // namespace

ArmMotion arm_motion(const Recording& recording, const ArmModel& arm) {
  ArmMotion motion{.name = recording.name(), .sample_rate_Hz = recording.sample_rate_Hz()};
  for (const ArmJoint& joint : arm.joints) {
    const std::string prefix = joint_prefix(joint.name);
    const std::string angle = prefix + "joint_angle_rad";
    motion.angle_rad.push_back(finite_channel(recording, angle, arm));
    motion.torque_Nm.push_back(finite_channel(recording, prefix + "estimated_torque_Nm", arm));
    const std::vector<double>& values = motion.angle_rad.back();
    for (std::size_t n = 0; n < values.size(); ++n)
      if (values[n] < joint.lowest_rad - kBeyondLimits_rad ||
          values[n] > joint.highest_rad + kBeyondLimits_rad)
        throw Error({.place = fmt::format("{}: {} at {:.3f} s", recording.name(), angle,
                                          recording.time_s(n)),
                     .problem = "the recording is of another arm",
                     .expected = fmt::format("an angle of '{}' within its limits, {:.4g} to {:.4g} "
                                             "rad",
                                             joint.name, joint.lowest_rad, joint.highest_rad),
                     .found = fmt::format("{:.4g} rad", values[n]),
                     .advice = "Give the YAML file of the arm that was recorded."});
  }
  return motion;
}

void require_motion(const ArmMotion& motion, const ArmModel& arm) {
  const std::size_t joints = arm.joints.size();
  if (motion.angle_rad.size() != joints || motion.torque_Nm.size() != joints)
    throw Error({.place = motion.name,
                 .expected = fmt::format("angles and torques of {} joints", joints),
                 .found = fmt::format("angles of {}, torques of {}", motion.angle_rad.size(),
                                      motion.torque_Nm.size())});
  const std::size_t samples = motion.angle_rad.front().size();
  double largest_rad = 0.0;
  for (std::size_t j = 0; j < joints; ++j) {
    if (motion.angle_rad[j].size() != samples || motion.torque_Nm[j].size() != samples)
      throw Error({.place = motion.name,
                   .expected = fmt::format("{} samples of '{}'", samples, arm.joints[j].name),
                   .found = fmt::format("{} angles, {} torques", motion.angle_rad[j].size(),
                                        motion.torque_Nm[j].size())});
    const auto [lowest, highest] = std::ranges::minmax_element(motion.angle_rad[j]);
    if (samples > 0) largest_rad = std::max(largest_rad, *highest - *lowest);
  }
  if (!(motion.sample_rate_Hz >= kSlowestRate_Hz && motion.sample_rate_Hz <= kFastestRate_Hz))
    throw Error({.place = motion.name,
                 .expected = "a sample rate of 50 Hz to 100 kHz",
                 .found = fmt::format("{:g} Hz", motion.sample_rate_Hz)});
  if (samples > 0 && largest_rad < kStill_rad)
    throw Error({.place = motion.name,
                 .problem = "the arm does not move",
                 .expected = "a joint that moves by more than 0.01 rad",
                 .found = fmt::format("{:.2g} rad", largest_rad),
                 .advice = "Record several moves: 'torsio arm excite' writes a program of them."});
}

}  // namespace torsio
