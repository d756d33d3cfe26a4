#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The limits of one joint in a move.
struct JointMoveLimits {
  double lowest_rad = 0.0;
  double highest_rad = 0.0;
  double speed_rad_s = 0.0;
  double acceleration_rad_s2 = 0.0;
  double jerk_rad_s3 = 0.0;
};

/// @returns the limits of the arm's joints: its angles, 80 % of its speeds, and full speed is reached after
/// `speed_up_s` at the earliest, full acceleration after a quarter of that
[[nodiscard]] std::vector<JointMoveLimits> move_limits(const ArmModel& arm,
                                                       double speed_up_s = 0.5);

/// A move of all joints together from waypoint to waypoint, at rest in each: the move of least jerk,
///
///     q(t) = q₀ + d (10 s³ − 15 s⁴ + 6 s⁵),   s = t / T
///     T = max over the joints of  15 d / 8 v,  √(10 d / (√3 a)),  ∛(60 d / j)
///
/// as fast as the limits of speed v, acceleration a and jerk j of every joint allow. Between two waypoints every joint
/// stays between its two angles. Flash & Hogan (1985).
class ArmMove {
 public:
  struct Output {
    ArmDynamics::PerJoint position_rad = {};
    ArmDynamics::PerJoint velocity_rad_s = {};
    ArmDynamics::PerJoint acceleration_rad_s2 = {};
    bool is_done = false;  ///< the last waypoint is reached and held
  };

  /// @param waypoints_rad at least one, the start; each of as many angles as there are limits
  /// @throws UsageError that names waypoint and joint for an angle that is not finite or outside its limits, or a limit
  /// that is not positive.
  ArmMove(std::span<const std::vector<double>> waypoints_rad,
          std::span<const JointMoveLimits> limits, double sample_rate_Hz);

  /// The first output is the start.
  Output step() noexcept TORSIO_REALTIME;
  void reset() noexcept { sample_ = 0; }
  [[nodiscard]] double duration_s() const noexcept;

 private:
  struct Part {
    double start_s = 0.0;
    double duration_s = 0.0;
    ArmDynamics::PerJoint from_rad = {};
    ArmDynamics::PerJoint distance_rad = {};
  };

  std::size_t count_;
  double sample_rate_Hz_;
  std::vector<Part> parts_;
  ArmDynamics::PerJoint last_rad_ = {};
  std::uint64_t sample_ = 0;
  std::size_t part_ = 0;
};

}  // namespace torsio
