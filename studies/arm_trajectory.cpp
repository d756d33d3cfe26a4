#include "arm_trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {
namespace {

constexpr double kFastest_rad_s = rad_from_deg(25.0);
constexpr double kAcceleration_rad_s2 = rad_from_deg(30.0);  // as in the sweeps
constexpr double kJerk_rad_s3 = rad_from_deg(300.0);

// Configurations: the upper arm on both sides of upright, the elbow on both sides of straight; the last link is bent, so
// that the payload loads joint 4, which turns the forearm about its own axis.
constexpr std::array kMiddle_deg{0.0, -90.0, 0.0, 0.0, 75.0, 0.0};
constexpr std::array kHalfRange_deg{60.0, 65.0, 110.0, 100.0, 15.0, 90.0};

constexpr double kShortest_rad = rad_from_deg(45.0);
constexpr double kShortestShare = 0.5;

}  // namespace

std::vector<std::vector<double>> arm_configurations(std::size_t segments, std::uint64_t seed) {
  Random random(seed);
  std::vector<std::vector<double>> configurations;
  configurations.emplace_back();
  for (const double middle_deg : kMiddle_deg)
    configurations.front().push_back(rad_from_deg(middle_deg));
  while (configurations.size() <= segments) {
    std::vector<double> next;
    for (std::size_t j = 0; j < kMiddle_deg.size(); ++j)
      next.push_back(rad_from_deg(kMiddle_deg[j] + kHalfRange_deg[j] * random.uniform(-1.0, 1.0)));
    double longest = 0.0;
    double shortest = 1e9;
    for (const ArmPart& part : kArm) {
      const double way_rad = std::abs(next[part.index] - configurations.back()[part.index]);
      longest = std::max(longest, way_rad);
      shortest = std::min(shortest, way_rad);
    }
    if (longest < kShortest_rad || shortest < kShortestShare * longest) continue;
    configurations.push_back(std::move(next));
  }
  return configurations;
}

std::array<Recording, kArmJoints> record_arm(const std::vector<std::vector<double>>& configurations,
                                             std::uint64_t seed, const Progress& progress) {
  ArmSetup setup = arm6_setup();
  for (JointMoveLimits& limits : setup.moves) {
    limits.speed_rad_s = kFastest_rad_s;
    limits.acceleration_rad_s2 = kAcceleration_rad_s2;
    limits.jerk_rad_s3 = kJerk_rad_s3;
  }
  ArmRunSpec spec{.program = {.start_rad = configurations.front()}, .seed = seed};
  for (std::size_t k = 1; k < configurations.size(); ++k)
    spec.program.steps.push_back({.task = ArmTask::move, .to_rad = configurations[k]});
  ArmRun run = run_arm(setup, spec, progress);
  if (run.cause != ArmStopCause::none)
    throw Error({.place = "arm6",
                 .problem = fmt::format("stopped at {:.2f} s in {}: {}", run.stopped_s,
                                        run.stopped_joint, name(run.cause))});
  return {std::move(run.joints[kArm[0].index]), std::move(run.joints[kArm[1].index]),
          std::move(run.joints[kArm[2].index])};
}

}  // namespace torsio
