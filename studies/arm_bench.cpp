#include "arm_bench.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/report_progress.hpp"
#include "signal/joint_move.hpp"
#include "sim/bench/bench.hpp"
#include "sim/loops/bench_position_loop.hpp"
#include "sim/sensors/bench_log.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kGravity_m_s2 = 9.81;
constexpr double kFastest_rad_s = rad_from_deg(25.0);
constexpr double kAcceleration_rad_s2 = rad_from_deg(30.0);  // as in the sweeps

// Configurations: the upper arm up to 90 deg to either side of upright.
constexpr ArmAngles kMiddle_rad{std::numbers::pi, 0.0, 0.0};
constexpr ArmAngles kHalfRange_rad{rad_from_deg(90.0), rad_from_deg(120.0), rad_from_deg(100.0)};

// Every joint moves in every segment: one that creeps sticks and slips, and (16) has no such term.
constexpr double kShortest_rad = rad_from_deg(45.0);
constexpr double kShortestShare = 0.5;

/// A path through configurations in joint space, its coordinate being the travel of the joint that
/// moves the most.
class ArmPath {
 public:
  ArmPath(std::size_t segments, std::uint64_t seed) {
    Random random(seed);
    configurations_.push_back(kMiddle_rad);
    travel_.push_back(0.0);
    while (configurations_.size() <= segments) {
      ArmAngles next{};
      ArmAngles way_rad{};
      for (std::size_t j = 0; j < kArmJoints; ++j) {
        next[j] = kMiddle_rad[j] + kHalfRange_rad[j] * (2.0 * random.uniform() - 1.0);
        way_rad[j] = std::abs(next[j] - configurations_.back()[j]);
      }
      const auto [shortest, longest] = std::ranges::minmax(way_rad);
      if (longest < kShortest_rad || shortest < kShortestShare * longest) continue;
      configurations_.push_back(next);
      travel_.push_back(travel_.back() + longest);
    }
  }

  [[nodiscard]] const std::vector<double>& travel() const { return travel_; }
  [[nodiscard]] ArmAngles at(double travel) const {
    const auto after = std::ranges::upper_bound(travel_, travel);
    const auto next = std::min<std::size_t>(static_cast<std::size_t>(after - travel_.begin()),
                                            travel_.size() - 1);
    const double share = (travel - travel_[next - 1]) / (travel_[next] - travel_[next - 1]);
    ArmAngles angles{};
    for (std::size_t j = 0; j < kArmJoints; ++j)
      angles[j] = std::lerp(configurations_[next - 1][j], configurations_[next][j], share);
    return angles;
  }

 private:
  std::vector<ArmAngles> configurations_;
  std::vector<double> travel_;
};

/// One joint with its sensors, its position loop and its log.
class ArmJoint {
 public:
  ArmJoint(std::size_t index, const ArmAngles& start_rad, std::size_t ticks, std::uint64_t seed)
      : index_(index),
        sheet_(data_sheet(kArm[index].actuator)),
        bench_(sheet_,
               {.name = std::string(kArm[index].joint),
                .duration_s = static_cast<double>(ticks) / kBenchRate_Hz,
                .seed = seed + index,
                .faults = kNoFaults},
               {.start = load(start_rad), .start_angle_rad = start_rad[index], .next = {}}),
        loop_(plant_parameters(sheet_), kBenchRate_Hz),
        log_(sheet_, ticks, false) {}

  [[nodiscard]] double angle_rad() const { return bench_.truth().plant.state().joint_angle_rad; }

  void tick(double wanted_rad, const ArmAngles& angles_rad) {
    const Measurement measured = bench_.sense();
    log_.add(measured, bench_.truth());
    bench_.act({.command = {.current_A = loop_.step(wanted_rad, measured.motor_angle_rad)},
                .load = load(angles_rad)});
  }
  [[nodiscard]] Recording finish() { return log_.finish(std::string(kArm[index_].joint)); }

 private:
  [[nodiscard]] Load load(const ArmAngles& angles_rad) const {
    return {.inertia_kg_m2 = arm_inertias()[index_],
            .external_torque_Nm = arm_gravity_torques(angles_rad)[index_]};
  }

  inline static const FaultSchedule kNoFaults{};

  std::size_t index_;
  DataSheet sheet_;
  Bench bench_;
  BenchPositionLoop loop_;
  BenchLog log_;
};

}  // namespace

ArmAngles arm_gravity_torques(const ArmAngles& angles_rad) {
  // From the hand inwards: masses times their horizontal distances from the joint.
  ArmAngles torques{};
  double absolute_rad = 0.0;
  ArmAngles sines{};
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    absolute_rad += angles_rad[j];
    sines[j] = std::sin(absolute_rad);
  }
  double outer_kg = 0.0;
  double moment_kg_m = 0.0;
  for (std::size_t j = kArmJoints; j-- > 0;) {
    const ArmPart& part = kArm[j];
    moment_kg_m += part.length_m * sines[j] * (0.5 * part.link_kg + part.tip_kg + outer_kg);
    outer_kg += part.link_kg + part.tip_kg;
    torques[j] = -kGravity_m_s2 * moment_kg_m;
  }
  return torques;
}

ArmAngles arm_inertias() {
  ArmAngles inertias{};
  for (std::size_t j = 0; j < kArmJoints; ++j) {
    double start_m = 0.0;
    for (std::size_t k = j; k < kArmJoints; ++k) {
      const ArmPart& part = kArm[k];
      inertias[j] += part.link_kg * std::pow(start_m + 0.5 * part.length_m, 2) +
                     part.tip_kg * std::pow(start_m + part.length_m, 2);
      start_m += part.length_m;
    }
  }
  return inertias;
}

std::array<Recording, kArmJoints> record_arm(std::size_t segments, std::uint64_t seed,
                                             const Progress& progress) {
  const ArmPath path(segments, seed);
  JointMove move({.waypoints_rad = path.travel(),
                  .speed_rad_s = kFastest_rad_s,
                  .acceleration_rad_s2 = kAcceleration_rad_s2},
                 kBenchRate_Hz);
  const auto ticks = static_cast<std::size_t>(std::ceil(move.duration_s() * kBenchRate_Hz));
  ArmAngles angles_rad = path.at(0.0);
  std::array joints{ArmJoint(0, angles_rad, ticks, seed), ArmJoint(1, angles_rad, ticks, seed),
                    ArmJoint(2, angles_rad, ticks, seed)};
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    if (tick % 1000 == 0)
      report_progress(progress, static_cast<double>(tick) / static_cast<double>(ticks),
                      "simulating the arm");
    const ArmAngles wanted_rad = path.at(move.step().position_rad);
    for (std::size_t j = 0; j < kArmJoints; ++j) angles_rad[j] = joints[j].angle_rad();
    for (std::size_t j = 0; j < kArmJoints; ++j) joints[j].tick(wanted_rad[j], angles_rad);
  }
  return {joints[0].finish(), joints[1].finish(), joints[2].finish()};
}

}  // namespace torsio
