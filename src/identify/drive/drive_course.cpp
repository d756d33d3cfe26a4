#include "identify/drive/drive_course.hpp"

#include <algorithm>

namespace torsio {
namespace {

/// Speed over 25 ms around a sample.
double speed_at(const DriveLog& log, std::size_t n) {
  const auto reach =
      std::max<std::size_t>(static_cast<std::size_t>(std::lround(0.0125 / log.sample_period_s)), 1);
  const std::size_t before = n > reach ? n - reach : 0;
  const std::size_t after = std::min(n + reach, log.size() - 1);
  return (log.angle_rad[after] - log.angle_rad[before]) /
         (static_cast<double>(after - before) * log.sample_period_s);
}

double load_torque_Nm(const DriveLog& log, std::size_t n) {
  const JointLoad& load = log.load.load;
  const std::size_t next = std::min(n + 1, log.size() - 1);
  const double acceleration = (speed_at(log, next) - speed_at(log, n)) / log.sample_period_s;
  return load.gravity_Nm * std::sin(log.angle_rad[n] + load.zero_rad) +
         (load.gravity_Nm > 0.0 ? 0.0 : load.inertia_kg_m2 * acceleration);
}

bool is_saturated(const DriveLog& log, std::size_t n) {
  double output = log.command[n];
  if (follows_goal(log.kind))
    output = log.gain * (log.command[n] - log.angle_rad[n]) - log.speed_gain * speed_at(log, n);
  return log.limit > 0.0 && std::abs(output) >= log.limit;
}

void compare_with_goal(const DriveLog& log, DriveCourse& course) {
  double count = 0.0;
  double goal = 0.0;
  double angle = 0.0;
  const auto for_each_driven = [&](const auto& take) {
    for (std::size_t n = 0; n < log.size(); ++n)
      if (is_powered(log, n)) take(log.command[n], log.angle_rad[n]);
  };
  for_each_driven([&](double wanted, double measured) {
    count += 1.0;
    goal += wanted;
    angle += measured;
  });
  double both = 0.0;
  double goals = 0.0;
  double angles = 0.0;
  for_each_driven([&](double wanted, double measured) {
    const double x = wanted - goal / count;
    const double y = measured - angle / count;
    both += x * y;
    goals += x * x;
    angles += y * y;
  });
  if (!(goals > 0.0) || !(angles > 0.0)) return;
  course.angle_per_goal = both / goals;
  course.angle_with_goal = both / std::sqrt(goals * angles);
}

}  // namespace

DriveCourse drive_course(const DriveLog& log) {
  DriveCourse course;
  constexpr double kMoving_rad_s = 0.02;
  constexpr double kPassive_s = 0.1;
  std::size_t passive = 0;
  for (std::size_t n = 0; n < log.size(); ++n) {
    const double speed = std::abs(speed_at(log, n));
    course.largest_speed_rad_s = std::max(course.largest_speed_rad_s, speed);
    const double torque = load_torque_Nm(log, n);
    course.lowest_load_Nm = std::min(course.lowest_load_Nm, torque);
    course.highest_load_Nm = std::max(course.highest_load_Nm, torque);
    if (speed < kMoving_rad_s) continue;
    if (!is_powered(log, n)) {
      ++passive;
      continue;
    }
    ++course.driven;
    if (is_saturated(log, n)) ++course.saturated;
  }
  course.has_passive_motion = static_cast<double>(passive) * log.sample_period_s > kPassive_s;
  const auto [low, high] = std::ranges::minmax(log.command);
  course.command_range = high - low;
  const auto [left, right] = std::ranges::minmax(log.angle_rad);
  course.angle_range_rad = right - left;
  if (follows_goal(log.kind)) compare_with_goal(log, course);
  return course;
}

}  // namespace torsio
