#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "sim/experiments/results.hpp"
#include "support/every_actuator.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::range;

Recording simulated(const std::string& actuator, const std::string& experiment, double duration_s) {
  return simulate({.actuator = actuator,
                   .experiment = experiment,
                   .duration_s = duration_s,
                   .with_truth = true});
}

const std::vector<double>& truth_of(const Recording& recording, const std::string& name) {
  return recording.channel("truth_" + name).values;
}

/// The sum over `PART1_Nm`, `PART2_Nm`, ..., and how many there are.
struct Sum {
  std::vector<double> of;
  int parts = 0;
};
Sum sum_of(const Recording& recording, const std::string& part) {
  Sum sum{std::vector<double>(recording.size()), 0};
  while (recording.has("truth_" + part + std::to_string(sum.parts + 1) + "_Nm")) {
    const auto& force = truth_of(recording, part + std::to_string(++sum.parts) + "_Nm");
    for (std::size_t i = 0; i < force.size(); ++i) sum.of[i] += force[i];
  }
  return sum;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(Truth, TheSlipElementsOfASpringAddUpToItsFriction) {
  const Recording recording = simulated("dfki-50", "static-cycle", 6.0);
  const Sum slip = sum_of(recording, "spring_slip");
  EXPECT_EQ(slip.parts, 4);
  EXPECT_GT(range(slip.of), 0.5);
  EXPECT_LT(largest_difference(slip.of, truth_of(recording, "spring_friction_Nm")), 1e-12);
}

TEST(Truth, SlipElementsAndBranchesOfRubberAddUpToItsFriction) {
  const Recording recording = simulated("rubber-clutch", "slow-cycles", 20.0);
  Sum sum = sum_of(recording, "rubber_slip");
  const Sum branches = sum_of(recording, "rubber_branch");
  EXPECT_EQ(sum.parts, 3);
  EXPECT_EQ(branches.parts, 3);
  for (std::size_t i = 0; i < sum.of.size(); ++i) sum.of[i] += branches.of[i];
  EXPECT_GT(range(sum.of), 0.01);
  EXPECT_LT(largest_difference(sum.of, truth_of(recording, "rubber_friction_Nm")), 1e-12);
}

/// What friction and bristle differ by, at its largest, over the fastest speed.
double viscosity(const Recording& recording, const std::string& place, const std::string& body) {
  const auto magnitude = [](double value) { return std::abs(value); };
  const double fastest = std::abs(
      *std::ranges::max_element(truth_of(recording, body + "_speed_rad_s"), {}, magnitude));
  return largest_difference(truth_of(recording, place + "_friction_Nm"),
                            truth_of(recording, place + "_bristle_Nm")) /
         fastest;
}

TEST(Truth, FrictionIsTheBristleAndWhatIsViscous) {
  // The friction is that of the speed before the step: equal to a percent or so.
  const Recording sweep = simulated("dfki-120", "sweep", 4.0);
  const double motor = plant_parameters(data_sheet("dfki-120")).rotor_friction.viscous_Nms_rad;
  EXPECT_GT(range(truth_of(sweep, "motor_bristle_Nm")), 0.01);
  EXPECT_NEAR(viscosity(sweep, "motor", "motor"), motor, 0.02 * motor);
  const Recording drive = simulated("harmonic-drive", "human-torque", 4.0);
  const double generator =
      plant_parameters(data_sheet("harmonic-drive")).middle_friction.viscous_Nms_rad;
  EXPECT_GT(range(truth_of(drive, "wave_generator_bristle_Nm")), 0.01);
  EXPECT_NEAR(viscosity(drive, "wave_generator", "wave_generator"), generator, 0.02 * generator);
  EXPECT_FALSE(drive.has("truth_motor_bristle_Nm"));
}

TEST(Truth, EncodersMeasureTheTrueAnglesToAFewCodes) {
  const Recording recording = simulated("dfki-50", "sweep", 4.0);
  const double code_rad = rad_from_deg(0.1);
  for (const char* body : {"gear", "joint"}) {
    const auto& measured = recording.channel(std::string(body) + "_angle_rad").values;
    const auto& truth = truth_of(recording, std::string(body) + "_angle_rad");
    EXPECT_GT(range(truth), 0.1) << body;
    EXPECT_LT(largest_difference(measured, truth), code_rad) << body;
  }
}

TEST(Truth, TheClutchReportsItsSlip) {
  const Recording recording = simulated("rubber-clutch", "slip", 40.0);
  const auto& slip = truth_of(recording, "clutch_slip_rad");
  const auto& is_slipping = truth_of(recording, "clutch_is_slipping_1");
  EXPECT_GT(range(slip), 0.05);
  EXPECT_EQ(range(is_slipping), 1.0);
  for (std::size_t i = 1; i < slip.size(); ++i) {
    // Between two samples it may slip and stick again; where it sticks at both and never broke
    // loose, the slip stays.
    if (slip[i] != slip[i - 1]) continue;
    EXPECT_EQ(is_slipping[i] * is_slipping[i - 1], 0.0) << i;
  }
}

TEST(Truth, AnUnbondedCouplingHasTwoChainsAndACreepingGlue) {
  const Recording bonded = simulated("elastomer", "triangles", 3.0);
  EXPECT_TRUE(bonded.has("truth_coupling_creep3_rad"));
  EXPECT_FALSE(bonded.has("truth_coupling_positive_creep1_rad"));
  const Recording unbonded = simulated("elastomer:unbonded", "triangles", 3.0);
  EXPECT_GE(*std::ranges::min_element(truth_of(unbonded, "coupling_positive_creep1_rad")), -1e-15);
  EXPECT_LE(*std::ranges::max_element(truth_of(unbonded, "coupling_negative_creep1_rad")), 1e-15);
  EXPECT_GT(range(truth_of(unbonded, "coupling_positive_creep1_rad")), 0.0);
}

TEST(Truth, TemperatureIsThatOfTheConditions) {
  const Recording recording = simulate({.duration_s = 4.0,
                                        .with_truth = true,
                                        .conditions = {.warm_up_K = 20.0, .warm_up_time_s = 2.0}});
  const auto& temperature_K = truth_of(recording, "temperature_K");
  EXPECT_NEAR(temperature_K.front(), OperatingConditions::kReference_K, 1e-9);
  EXPECT_NEAR(temperature_K[2000], OperatingConditions::kReference_K + 20.0 * (1 - std::exp(-1.0)),
              1e-9);
}

TEST(Truth, EveryActuatorHasFiniteNumbersOnlyIfRequested) {
  for (const std::string& name : test::every_actuator()) {
    const ExperimentSpec plain{.actuator = name, .experiment = "static-cycle", .duration_s = 1.0};
    ExperimentSpec with = plain;
    with.with_truth = true;
    std::size_t channels = 0;
    const Recording recording = simulate(with);
    for (const Channel& channel : recording.channels()) {
      if (!channel.name.starts_with("truth_")) continue;
      ++channels;
      EXPECT_EQ(channel.values.size(), recording.size()) << channel.name;
      EXPECT_TRUE(std::ranges::all_of(channel.values, [](double v) { return std::isfinite(v); }))
          << name << " " << channel.name;
    }
    EXPECT_GT(channels, 15U) << name;
    EXPECT_EQ(simulate(plain).channels().size() + channels, recording.channels().size()) << name;
  }
}

}  // namespace
}  // namespace torsio
