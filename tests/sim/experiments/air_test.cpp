// The lever in the air, and what all experiments log of their commands.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <vector>

#include "sim/experiments/results.hpp"
#include "sim/plant/plant.hpp"
#include "support/every_actuator.hpp"
#include "support/refusal.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::largest;
using test::range;
using test::refusal_of;
using LoggedValues = std::vector<double>;

const LoggedValues& logged(const Recording& recording, const char* channel) {
  return recording.channel(channel).values;
}

double condition_of(const Recording& recording, const char* condition) {
  return logged(recording, condition).front();
}

double rms_between(const LoggedValues& of, std::size_t first, std::size_t last) {
  double squares = 0.0;
  for (std::size_t i = first; i < last; ++i) squares += of[i] * of[i];
  return std::sqrt(squares / static_cast<double>(last - first));
}

double rms_of(const LoggedValues& of) { return rms_between(of, 0, of.size()); }

// What `identify` relies on: a reader of the log repeats the drive's law without anything else.
TEST(AirChirp, TorqueFollowsFromTheGoalTheRotorAndTheLawThatAreLogged) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120:bouc-wen"}) {
    const Recording recording = simulate({.actuator = actuator, .experiment = "air-chirp"});
    const LoggedValues& goal = logged(recording, "goal_angle_rad");
    const LoggedValues& rotor = logged(recording, "motor_angle_rad");
    const double ratio = condition_of(recording, "gear_ratio_1");
    const double limit_Nm = condition_of(recording, "torque_limit_Nm");
    double worst_Nm = 0.0;
    for (std::size_t i = 1; i < rotor.size(); ++i) {
      const double angle_rad = rotor[i] / ratio;
      const double speed_rad_s = (angle_rad - rotor[i - 1] / ratio) * recording.sample_rate_Hz();
      const double law_Nm = condition_of(recording, "kp_Nm_rad") * (goal[i] - angle_rad) -
                            condition_of(recording, "kd_Nms_rad") * speed_rad_s;
      worst_Nm = std::max(worst_Nm, std::abs(std::clamp(law_Nm, -limit_Nm, limit_Nm) -
                                             logged(recording, "command_torque_Nm")[i]));
    }
    EXPECT_LT(worst_Nm, 1e-9) << actuator;
    EXPECT_NEAR(largest(goal), rad_from_deg(20.0), 0.02) << actuator;
  }
}

TEST(AirChirp, MotorMakesTheTorqueThatIsLogged) {
  for (const char* actuator :
       {"dfki-28", "dfki-50", "dfki-120", "elastomer", "harmonic-drive:soft"}) {
    const Recording recording =
        simulate({.actuator = actuator, .experiment = "air-chirp", .with_truth = true});
    LoggedValues error = logged(recording, "truth_motor_torque_Nm");
    const LoggedValues& asked = logged(recording, "command_torque_Nm");
    for (std::size_t i = 0; i < error.size(); ++i)
      error[i] = condition_of(recording, "gear_ratio_1") * error[i] - asked[i];
    // The lag of the current, and the ripple: of dfki-* 0.6 %, of the elastomer's motor 9 % of what it makes here.
    EXPECT_LT(rms_of(error), 0.12 * rms_of(asked)) << actuator;
    EXPECT_GT(rms_of(asked), 0.1 * condition_of(recording, "torque_limit_Nm")) << actuator;
  }
}

// T = m g l cos(incl) sin q + (J + m l²) q̈ + bearing, of the stated mass and length.
TEST(AirChirp, StatedLoadExplainsTheTorqueAtTheLoadCell) {
  const Recording recording = simulate({.experiment = "air-chirp",
                                        .lever_m = 0.2,
                                        .mass_kg = 6.0,
                                        .inclination_rad = 0.4,
                                        .with_truth = true});
  const double moment_kg_m =
      condition_of(recording, "mass_kg") * condition_of(recording, "lever_m");
  const double inertia_kg_m2 = data_sheet("dfki-50").joint.inertia_kg_m2.value +
                               moment_kg_m * condition_of(recording, "lever_m");
  EXPECT_DOUBLE_EQ(moment_kg_m, 1.2);
  const LoggedValues& angle = logged(recording, "truth_joint_angle_rad");
  const LoggedValues& speed = logged(recording, "truth_joint_speed_rad_s");
  const LoggedValues& torque = logged(recording, "truth_torque_Nm");
  LoggedValues error;
  for (std::size_t i = 1; i + 1 < angle.size(); ++i) {
    const double acceleration = 0.5 * (speed[i + 1] - speed[i - 1]) * recording.sample_rate_Hz();
    error.push_back(torque[i] - inertia_kg_m2 * acceleration -
                    9.81 * moment_kg_m * std::cos(condition_of(recording, "inclination_rad")) *
                        std::sin(angle[i]));
  }
  EXPECT_LT(rms_of(error), 0.02 * rms_of(torque));
}

TEST(AirChirp, JointSwingsPastTheGoalWhereItsSpringResonates) {
  const auto gain = [](const char* actuator, double lever_m, double frequency_Hz) {
    const Recording recording =
        simulate({.actuator = actuator, .experiment = "air-chirp", .lever_m = lever_m});
    // Equal octaves from 0.1 to 8 Hz in 60 s; a quarter of an octave around the frequency.
    const auto sample = [](double of_Hz) {
      return static_cast<std::size_t>(60e3 * std::log(of_Hz / 0.1) / std::log(80.0));
    };
    const std::size_t first = sample(frequency_Hz / 1.09);
    const std::size_t last = sample(frequency_Hz * 1.09);
    return rms_between(logged(recording, "joint_angle_rad"), first, last) /
           rms_between(logged(recording, "goal_angle_rad"), first, last);
  };
  EXPECT_GT(gain("dfki-50", 0.2, 5.0), 2.0);
  EXPECT_LT(gain("dfki-50", 0.2, 7.5), 1.0);
  EXPECT_NEAR(gain("dfki-50", 0.2, 0.5), 1.0, 0.1);
  EXPECT_GT(gain("dfki-120", 0.35, 4.5), 2.5);
}

TEST(AirChirp, EndsAtTheFrequencyThatIsAskedFor) {
  const Recording recording = simulate({.experiment = "air-chirp",
                                        .duration_s = 20.0,
                                        .angle_amplitude_rad = 0.2,
                                        .lowest_frequency_Hz = 0.5,
                                        .highest_frequency_Hz = 2.0});
  const LoggedValues& goal = logged(recording, "goal_angle_rad");
  // Above 0.4 Hz the speed stays: the amplitude is 0.2 rad times 0.4 Hz over the frequency.
  EXPECT_NEAR(largest(goal), 0.2 * 0.4 / 0.5, 0.02);
  EXPECT_NEAR(largest(std::span(goal).last(500)), 0.2 * 0.4 / 2.0, 0.002);
  const auto crossings = [&](std::size_t first, std::size_t last) {
    int count = 0;
    for (std::size_t i = first + 1; i < last; ++i) count += goal[i - 1] * goal[i] < 0.0;
    return count;
  };
  EXPECT_NEAR(crossings(18000, 20000), 2 * 2 * 1.9, 1.1);
  EXPECT_NEAR(crossings(0, 4000), 2 * 4 * 0.57, 1.1);
}

TEST(AirExperiments, DrawTheirGoalsFromTheSeedAndStayWithinTheAmplitude) {
  for (const char* experiment : {"air-steps", "air-multisine"}) {
    const auto goal = [&](std::uint64_t seed) {
      return logged(simulate({.experiment = experiment,
                              .seed = seed,
                              .duration_s = 15.0,
                              .angle_amplitude_rad = 0.25}),
                    "goal_angle_rad");
    };
    const LoggedValues first = goal(1);
    EXPECT_EQ(first, goal(1)) << experiment;
    EXPECT_NE(first, goal(2)) << experiment;
    EXPECT_LE(largest(first), 0.25 + 1e-12) << experiment;
    EXPECT_GT(largest(first), 0.15) << experiment;
    EXPECT_GT(range(first), 0.3) << experiment;
  }
  EXPECT_EQ(
      logged(simulate({.experiment = "air-chirp", .seed = 1, .duration_s = 2.0}), "goal_angle_rad"),
      logged(simulate({.experiment = "air-chirp", .seed = 2, .duration_s = 2.0}),
             "goal_angle_rad"));
}

// Without power nothing but friction and gravity act on the lever, which the log marks.
TEST(AirRelease, LeverFallsWithoutPowerAndComesToRest) {
  const Recording recording =
      simulate({.experiment = "air-release", .lever_m = 0.24, .with_truth = true});
  const LoggedValues& enabled = logged(recording, "enabled_1");
  const LoggedValues& angle = logged(recording, "joint_angle_rad");
  EXPECT_EQ(std::ranges::count(enabled, 1.0), 1000);
  EXPECT_EQ(std::ranges::count(enabled, 0.0), 5000);
  EXPECT_NEAR(angle[999], rad_from_deg(60.0), 0.08);
  EXPECT_LT(angle.back(), rad_from_deg(35.0));
  EXPECT_NEAR(angle.back(), angle[angle.size() - 200], 1e-3);
  const LoggedValues& current = logged(recording, "truth_motor_current_A");
  EXPECT_GT(std::abs(current[900]), 0.5);
  EXPECT_LT(largest(std::span(current).last(4900)), 1e-9);
  EXPECT_EQ(largest(std::span(logged(recording, "command_torque_Nm")).last(5000)), 0.0);
}

TEST(AirExperiments, RefuseWhatTheBenchCannotDo) {
  const auto refused = [](const ExperimentSpec& spec, const char* why) {
    const std::string text = refusal_of(spec);
    EXPECT_NE(text.find(why), std::string::npos) << text;
  };
  refused({.experiment = "air-chirp", .lowest_frequency_Hz = 9.0},
          "expected a frequency below the highest one, 8 Hz, found 9 Hz");
  refused({.experiment = "air-chirp", .highest_frequency_Hz = 30.0}, "0.001 to 20 Hz");
  refused({.experiment = "air-chirp", .highest_frequency_Hz = std::nan("")}, "0.001 to 20 Hz");
  refused({.experiment = "air-steps", .highest_frequency_Hz = 5.0}, "has no band of frequencies");
  refused({.experiment = "sweep", .lowest_frequency_Hz = 1.0}, "has no band of frequencies");
  refused({.experiment = "air-chirp", .mass_kg = 0.0}, "0 < kg <= 100");
  refused({.experiment = "static-cycle", .mass_kg = 1.0}, "has no lever");
  refused({.experiment = "air-chirp", .lever_m = 0.5, .mass_kg = 20.0},
          "at most the 50 Nm that dfki-50 is rated for, found 98.1 Nm (20 kg at 0.5 m)");
  refused({.experiment = "air-chirp", .torque_amplitude_Nm = 5.0}, "expected one in rad");
  refused({.experiment = "air-chirp", .angle_amplitude_rad = 2.0}, "at most 90 deg");
  refused({.actuator = "rubber-clutch", .experiment = "air-chirp"}, "not one of rubber-clutch");
}

TEST(Sweep, TakesAnotherMass) {
  const auto largest_Nm = [](double mass_kg) {
    return largest(logged(
        simulate({.experiment = "sweep", .duration_s = 12.0, .lever_m = 0.2, .mass_kg = mass_kg}),
        "torque_Nm"));
  };
  EXPECT_NEAR(largest_Nm(4.5) / largest_Nm(9.0), 0.5, 0.03);
}

TEST(Commands, EveryExperimentLogsWhatItIsAskedToDo) {
  for (const std::string& name : test::every_actuator()) {
    const DataSheet sheet = data_sheet(name);
    for (const ExperimentInfo& info : experiments(sheet)) {
      const Recording recording =
          simulate({.actuator = name, .experiment = std::string(info.name), .duration_s = 0.2});
      const bool has_angle = recording.has("goal_angle_rad");
      EXPECT_NE(has_angle, recording.has("goal_torque_Nm")) << recording.name();
      const LoggedValues& goal = logged(recording, has_angle ? "goal_angle_rad" : "goal_torque_Nm");
      EXPECT_TRUE(std::ranges::all_of(goal, [](double v) { return std::isfinite(v); }))
          << recording.name();
    }
  }
}

TEST(Commands, AreWhatTheBenchFollows) {
  const auto error = [](const ExperimentSpec& spec, const char* goal, const char* measured,
                        double scale) {
    const Recording recording = simulate(spec);
    LoggedValues difference = logged(recording, measured);
    for (std::size_t i = 0; i < difference.size(); ++i)
      difference[i] = scale * difference[i] - logged(recording, goal)[i];
    return rms_between(difference, difference.size() / 5, difference.size()) /
           rms_of(logged(recording, goal));
  };
  EXPECT_LT(error({.experiment = "sweep", .duration_s = 30.0}, "goal_angle_rad", "motor_angle_rad",
                  1.0 / 120.0),
            0.02);
  EXPECT_LT(error({.experiment = "chirp", .duration_s = 60.0}, "goal_torque_Nm", "torque_Nm", 1.0),
            0.25);
  EXPECT_LT(error({.experiment = "static-cycle"}, "goal_torque_Nm", "torque_Nm", 1.0), 0.05);
  EXPECT_LT(error({.actuator = "elastomer", .experiment = "triangles"}, "goal_torque_Nm",
                  "torque_Nm", 1.0),
            0.15);
  EXPECT_LT(error({.actuator = "rubber-clutch", .experiment = "multisine"}, "goal_angle_rad",
                  "input_angle_rad", 1.0),
            0.1);
}

}  // namespace
}  // namespace torsio
