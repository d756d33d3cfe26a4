#include "torsio/arm/arm_move.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr double kSpeedOfLeastJerk = 15.0 / 8.0;  // the largest values of s', s'' and s'''
constexpr double kAccelerationOfLeastJerk = 10.0 / std::numbers::sqrt3;
constexpr double kJerkOfLeastJerk = 60.0;
/// Controllers keep a margin below the speed limit, which a move must not touch.
constexpr double kSpeedShare = 0.8;

void check(const JointMoveLimits& limits, std::size_t joint) {
  const auto positive = [&](double value, std::string_view name) {
    require<UsageError>(value > 0.0 && std::isfinite(value),
                        {fmt::format("arm move: joint {}", joint + 1), name}, "a positive number",
                        value);
  };
  positive(limits.speed_rad_s, "speed");
  positive(limits.acceleration_rad_s2, "acceleration");
  positive(limits.jerk_rad_s3, "jerk");
}

double least_time(double distance_rad, const JointMoveLimits& limits) {
  return std::max({kSpeedOfLeastJerk * distance_rad / limits.speed_rad_s,
                   std::sqrt(kAccelerationOfLeastJerk * distance_rad / limits.acceleration_rad_s2),
                   std::cbrt(kJerkOfLeastJerk * distance_rad / limits.jerk_rad_s3)});
}

}  // namespace

std::vector<JointMoveLimits> move_limits(const ArmModel& arm, double speed_up_s) {
  std::vector<JointMoveLimits> limits;
  for (const ArmJoint& joint : arm.joints) {
    const double speed_rad_s = kSpeedShare * joint.speed_rad_s;
    const double acceleration_rad_s2 = speed_rad_s / speed_up_s;
    limits.push_back({joint.lowest_rad, joint.highest_rad, speed_rad_s, acceleration_rad_s2,
                      4.0 * acceleration_rad_s2 / speed_up_s});
  }
  return limits;
}

ArmMove::ArmMove(std::span<const std::vector<double>> waypoints_rad,
                 std::span<const JointMoveLimits> limits, double sample_rate_Hz)
    : count_(limits.size()), sample_rate_Hz_(sample_rate_Hz) {
  require<UsageError>(sample_rate_Hz > 0.0 && std::isfinite(sample_rate_Hz),
                      "arm move: sample rate", "a positive number", sample_rate_Hz);
  require<UsageError>(!waypoints_rad.empty(), "arm move", "at least one waypoint", "none");
  require<UsageError>(count_ > 0 && count_ <= kMaxArmJoints, "arm move",
                      fmt::format("1 to {} joints", kMaxArmJoints), fmt::format("{}", count_));
  for (std::size_t j = 0; j < count_; ++j) check(limits[j], j);
  for (std::size_t w = 0; w < waypoints_rad.size(); ++w) {
    const std::string place = fmt::format("arm move: waypoint {}", w + 1);
    require<UsageError>(waypoints_rad[w].size() == count_, place,
                        fmt::format("{} angles, one per joint", count_),
                        fmt::format("{}", waypoints_rad[w].size()));
    for (std::size_t j = 0; j < count_; ++j) {
      const double angle_rad = waypoints_rad[w][j];
      require<UsageError>(angle_rad >= limits[j].lowest_rad && angle_rad <= limits[j].highest_rad,
                          {place, fmt::format("joint {}", j + 1)},
                          fmt::format("an angle within its limits, {:.4g} to {:.4g} rad",
                                      limits[j].lowest_rad, limits[j].highest_rad),
                          fmt::format("{:.4g} rad", angle_rad));
    }
  }
  for (std::size_t w = 0; w + 1 < waypoints_rad.size(); ++w) {
    Part part{.start_s = duration_s()};
    for (std::size_t j = 0; j < count_; ++j) {
      part.from_rad[j] = waypoints_rad[w][j];
      part.distance_rad[j] = waypoints_rad[w + 1][j] - waypoints_rad[w][j];
      part.duration_s =
          std::max(part.duration_s, least_time(std::abs(part.distance_rad[j]), limits[j]));
    }
    if (part.duration_s > 0.0) parts_.push_back(part);
  }
  std::ranges::copy(waypoints_rad.back(), last_rad_.begin());
}

double ArmMove::duration_s() const noexcept {
  return parts_.empty() ? 0.0 : parts_.back().start_s + parts_.back().duration_s;
}

ArmMove::Output ArmMove::step() noexcept {
  if (sample_ == 0) part_ = 0;
  const double time_s = static_cast<double>(sample_++) / sample_rate_Hz_;
  while (part_ < parts_.size() && time_s >= parts_[part_].start_s + parts_[part_].duration_s)
    ++part_;
  if (part_ == parts_.size()) return {.position_rad = last_rad_, .is_done = true};
  const Part& part = parts_[part_];
  const double s = (time_s - part.start_s) / part.duration_s;
  const double position = s * s * s * (10.0 + s * (-15.0 + 6.0 * s));
  const double velocity = 30.0 * s * s * (1.0 + s * (-2.0 + s)) / part.duration_s;
  const double acceleration =
      60.0 * s * (1.0 + s * (-3.0 + 2.0 * s)) / (part.duration_s * part.duration_s);
  Output output;
  for (std::size_t j = 0; j < count_; ++j) {
    output.position_rad[j] = part.from_rad[j] + position * part.distance_rad[j];
    output.velocity_rad_s[j] = velocity * part.distance_rad[j];
    output.acceleration_rad_s2[j] = acceleration * part.distance_rad[j];
  }
  return output;
}

}  // namespace torsio
