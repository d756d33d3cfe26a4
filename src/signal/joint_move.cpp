#include "signal/joint_move.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>

#include "core/checks.hpp"

namespace torsio {
namespace {

void require_positive_number(std::string_view name, double value) {
  require<UsageError>(value > 0.0 && std::isfinite(value), {"joint move", name},
                      "a positive number", value);
}

std::vector<double> distinct(std::vector<double> waypoints_rad) {
  if (waypoints_rad.empty())
    throw UsageError({.place = "joint move", .expected = "at least one waypoint", .found = "none"});
  for (const double waypoint_rad : waypoints_rad) {
    require<UsageError>(std::isfinite(waypoint_rad), "joint move: waypoints", "finite angles",
                        waypoint_rad);
  }
  waypoints_rad.erase(std::unique(waypoints_rad.begin(), waypoints_rad.end()), waypoints_rad.end());
  return waypoints_rad;
}

/// The shortest time of the move of least jerk over this distance.
double least_time(double distance_rad, const JointMove::Parameters& limits) {
  return std::max(
      15.0 / 8.0 * distance_rad / limits.speed_rad_s,
      std::sqrt(10.0 / std::numbers::sqrt3 * distance_rad / limits.acceleration_rad_s2));
}

}  // namespace

JointMove::Part JointMove::part(double from_rad, double to_rad, double from_rad_s, double to_rad_s,
                                double duration_s) {
  const double distance = to_rad - from_rad;
  const double first = from_rad_s * duration_s;
  const double last = to_rad_s * duration_s;
  return {.duration_s = duration_s,
          .coefficients = {from_rad, first, 0.0, 10.0 * distance - 6.0 * first - 4.0 * last,
                           -15.0 * distance + 8.0 * first + 7.0 * last,
                           6.0 * distance - 3.0 * first - 3.0 * last}};
}

// By how much longer the part must last: q̈ = s (6 c₃ + 12 c₄ s + 20 c₅ s²) / T² has, beside 0 and 1,
// one more zero, where the speed may be largest; its own largest values are at the zeros of a parabola.
double JointMove::excess(const Part& part, const Parameters& limits) {
  const auto& c = part.coefficients;
  const auto speed = [&](double s) {
    return std::abs(c[1] + s * s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5]))) /
           part.duration_s;
  };
  const auto acceleration = [&](double s) {
    return std::abs(s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5]))) /
           (part.duration_s * part.duration_s);
  };
  const auto inside = [](double s) { return std::isfinite(s) ? std::clamp(s, 0.0, 1.0) : 0.0; };
  const double fastest = std::max(
      {speed(0.0), speed(1.0), speed(inside(c[5] != 0.0 ? 6.0 * c[3] / (20.0 * c[5]) : 0.5))});
  double strongest = 0.0;
  const double discriminant = 24.0 * c[4] * 24.0 * c[4] - 4.0 * 6.0 * c[3] * 60.0 * c[5];
  if (c[5] == 0.0) {
    strongest = acceleration(inside(-c[3] / (4.0 * c[4])));
  } else if (discriminant >= 0.0) {
    for (const double root : {-std::sqrt(discriminant), std::sqrt(discriminant)})
      strongest = std::max(strongest, acceleration(inside((-24.0 * c[4] + root) / (120.0 * c[5]))));
  }
  return std::max(fastest / limits.speed_rad_s, std::sqrt(strongest / limits.acceleration_rad_s2));
}

JointMove::JointMove(const Parameters& parameters, double sample_rate_Hz) : clock_(sample_rate_Hz) {
  require_positive_number("sample rate", sample_rate_Hz);
  require_positive_number("speed", parameters.speed_rad_s);
  require_positive_number("acceleration", parameters.acceleration_rad_s2);
  const std::vector<double> waypoints = distinct(parameters.waypoints_rad);
  last_rad_ = waypoints.back();
  std::vector<double> times;
  for (std::size_t i = 0; i + 1 < waypoints.size(); ++i)
    times.push_back(least_time(std::abs(waypoints[i + 1] - waypoints[i]), parameters));
  std::vector<double> speeds(waypoints.size(), 0.0);
  if (parameters.through == Through::pass) {
    for (std::size_t i = 1; i + 1 < waypoints.size(); ++i) {
      const double before = (waypoints[i] - waypoints[i - 1]) / times[i - 1];
      const double after = (waypoints[i + 1] - waypoints[i]) / times[i];
      if (before * after > 0.0) speeds[i] = 0.5 * (before + after);
    }
  }
  double stretch = 1.0;
  if (parameters.through == Through::pass) {
    stretch = 0.0;
    for (std::size_t i = 0; i < times.size(); ++i)
      stretch = std::max(
          stretch, excess(part(waypoints[i], waypoints[i + 1], speeds[i], speeds[i + 1], times[i]),
                          parameters));
  }
  for (std::size_t i = 0; i < times.size(); ++i) {
    Part next = part(waypoints[i], waypoints[i + 1], speeds[i] / stretch, speeds[i + 1] / stretch,
                     times[i] * stretch);
    next.start_s = duration_s_;
    duration_s_ += next.duration_s;
    parts_.push_back(next);
  }
}

void JointMove::reset() noexcept {
  clock_.reset();
  part_ = 0;
}

JointMove::Output JointMove::step() noexcept {
  const double time_s = clock_.next_s();
  while (part_ < parts_.size() && time_s >= parts_[part_].start_s + parts_[part_].duration_s)
    ++part_;
  if (part_ == parts_.size()) return {.position_rad = last_rad_, .is_done = true};
  const Part& now = parts_[part_];
  const double s = (time_s - now.start_s) / now.duration_s;
  const auto& c = now.coefficients;
  return {.position_rad = c[0] + s * (c[1] + s * s * (c[3] + s * (c[4] + s * c[5]))),
          .velocity_rad_s =
              (c[1] + s * s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5]))) / now.duration_s,
          .acceleration_rad_s2 = s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5])) /
                                 (now.duration_s * now.duration_s)};
}

}  // namespace torsio
