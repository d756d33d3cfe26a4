#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/loops/bench_deflection_loop.hpp"
#include "sim/loops/bench_torque_loop.hpp"
#include "sim/sensors/sensor_set.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "support/series_elastic.hpp"
#include "support/straight_line.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/excitation.hpp"
#include "torsio/sim/experiments/experiment.hpp"

// Tracking of a torque. Specification 6 gives MAD and STD of |e| of a controller whose
// linear model was fitted to sweeps, with 13 Nm on dfki-50 and 20 Nm on dfki-120.

namespace torsio {
namespace {

using test::kRate_Hz;

constexpr std::size_t kSettled = 2000;

/// [Nm]
struct TrackingError {
  double mad = 0.0;
  double std = 0.0;  ///< standard deviation of |e|
  double rmse = 0.0;
};

TrackingError error_of(const std::vector<double>& wanted, const std::vector<double>& torque) {
  double sum = 0.0;
  double squares = 0.0;
  for (std::size_t i = kSettled; i < torque.size(); ++i) {
    const double error = wanted[i] - torque[i];
    sum += std::abs(error);
    squares += error * error;
  }
  const auto n = static_cast<double>(torque.size() - kSettled);
  const double mad = sum / n;
  return {mad, std::sqrt(squares / n - mad * mad), std::sqrt(squares / n)};
}

double rms(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

std::vector<double> wanted_chirp(double amplitude_Nm, std::size_t samples) {
  Chirp chirp({.amplitude = amplitude_Nm}, kRate_Hz);
  std::vector<double> wanted(samples);
  for (double& value : wanted) value = chirp.step();
  return wanted;
}

Recording torque_run(const std::string& actuator, const std::string& experiment,
                     std::uint64_t seed = 5) {
  return simulate(
      {.actuator = actuator, .experiment = experiment, .seed = seed, .with_truth = true});
}

TrackingError chirp_error(const ExperimentSpec& spec, double amplitude_Nm) {
  const Recording recording = simulate(spec);
  return error_of(wanted_chirp(amplitude_Nm, recording.size()),
                  recording.channel("truth_torque_Nm").values);
}

/// The chirp with the output locked, tracked with a line that a sweep gave.
TrackingError chirp_error_with_sweep_line(const char* actuator, double amplitude_Nm) {
  const DataSheet sheet = data_sheet(actuator);
  const test::Line line = test::spring_line(
      simulate({.actuator = actuator,
                .lever_m = sweep_protocol(data_sheet(actuator)).train_lever_m.back()}));
  const PlantParameters parts = plant_parameters(sheet);
  const Load locked{.is_locked = true};
  Plant plant(parts);
  plant.reset(0.0, locked);
  SensorSet sensors(sheet, kRate_Hz, 5);
  BenchDeflectionLoop loop(parts, kRate_Hz);
  const std::vector<double> wanted = wanted_chirp(amplitude_Nm, 100000);
  std::vector<double> torque;
  for (const double wanted_Nm : wanted) {
    torque.push_back(plant.torques().joint_Nm);
    const Measurement measured = sensors.step(sensed(plant), torque.back());
    const double wanted_rad = rad_from_deg((wanted_Nm - line.intercept) / line.slope);
    const double deflection_rad = measured.middle_angle_rad - measured.joint_angle_rad;
    EXPECT_EQ(plant.step({.current_A = loop.step(wanted_rad, deflection_rad)}, locked, 1e-3),
              Fault::none);
  }
  return error_of(wanted, torque);
}

// The prototype has 1.32±0.51 and 1.49±1.14 Nm (specification 6).
TEST(Chirp, WithALineFromASweepErrsAsThePrototypeDoes) {
  const TrackingError fifty = chirp_error_with_sweep_line("dfki-50", 13.0);
  EXPECT_NEAR(fifty.mad, 1.32, 0.25);
  EXPECT_NEAR(fifty.std, 0.51, 0.25);
  const TrackingError hundred_twenty = chirp_error_with_sweep_line("dfki-120", 20.0);
  EXPECT_NEAR(hundred_twenty.mad, 1.49, 0.25);
  EXPECT_NEAR(hundred_twenty.std, 1.14, 0.25);
}

// The experiment takes the stiffness of the data sheet, which inner friction makes too soft:
// the torque comes out about a tenth too large.
TEST(Chirp, ErrsByTheSpringsFrictionUnderTheLineOfTheDataSheet) {
  struct Case {
    const char* actuator;
    double amplitude_Nm;
    double mad_Nm;
    double rmse_Nm;
  };
  for (const Case& of : {Case{"dfki-28", 5.6, 0.79, 0.90}, Case{"dfki-50", 13.0, 1.57, 1.69},
                         Case{"dfki-120", 20.0, 1.61, 2.01}, Case{"dfki-300", 60.0, 3.44, 3.69}}) {
    SCOPED_TRACE(of.actuator);
    const TrackingError error =
        chirp_error({.actuator = of.actuator, .experiment = "chirp", .seed = 5, .with_truth = true},
                    of.amplitude_Nm);
    EXPECT_NEAR(error.mad, of.mad_Nm, 0.1 * of.mad_Nm);
    EXPECT_NEAR(error.rmse, of.rmse_Nm, 0.1 * of.rmse_Nm);
  }
}

TEST(Chirp, LeverSwingsFreely) {
  const Recording locked = torque_run("dfki-50", "chirp");
  const Recording free = simulate({.actuator = "dfki-50",
                                   .experiment = "chirp",
                                   .seed = 5,
                                   .lever_m = 0.8,
                                   .with_truth = true});
  const auto swing_deg = [](const Recording& recording) {
    const auto& angle = recording.channel("joint_angle_rad").values;
    return deg_from_rad(*std::ranges::max_element(angle) - *std::ranges::min_element(angle));
  };
  EXPECT_LT(swing_deg(locked), 0.01);
  EXPECT_GT(swing_deg(free), 30.0);
  EXPECT_LT(swing_deg(free), 60.0);
  const TrackingError error =
      error_of(wanted_chirp(13.0, free.size()), free.channel("truth_torque_Nm").values);
  EXPECT_NEAR(error.mad, 1.47, 0.15);  // the prototype's linear model: 1.29
}

TEST(Chirp, RefusesWhatTipsTheLeverOver) {
  const auto message = [](const ExperimentSpec& spec) {
    return test::error_message([&] { static_cast<void>(simulate(spec)); });
  };
  ExperimentSpec spec{
      .actuator = "dfki-120", .experiment = "chirp", .lever_m = 0.8, .torque_amplitude_Nm = 70.0};
  EXPECT_NE(message(spec).find("would tip the lever over"), std::string::npos);
  spec.lever_m.reset();
  spec.duration_s = 0.1;
  EXPECT_EQ(message(spec), "");
  spec.inclination_rad = 0.5;
  EXPECT_NE(message(spec).find("the output is locked"), std::string::npos);
  spec = {.actuator = "dfki-50", .experiment = "random-walk", .lever_m = 0.8};
  EXPECT_NE(message(spec).find("would tip the lever over"), std::string::npos);
  spec.torque_amplitude_Nm = 4.0;
  EXPECT_EQ(message(spec), "");
  spec.torque_amplitude_Nm = 20.0;
  EXPECT_NE(message(spec).find("at most 17.5 Nm"), std::string::npos);
}

// The references have equal RMS for every seed. The two results differ because the friction of
// dfki-28's spring is a large part of its torque.
TEST(RandomWalk, HasTheRmsOfTheChirp) {
  for (const DataSheet& sheet : test::series_elastic_sheets()) {
    const std::string actuator(sheet.name);
    const double chirp_Nm = rms(torque_run(actuator, "chirp").channel("truth_torque_Nm").values);
    const double walk_Nm =
        rms(torque_run(actuator, "random-walk").channel("truth_torque_Nm").values);
    const double band = sheet.name == "dfki-28" ? 0.12 : 0.05;
    EXPECT_NEAR(walk_Nm, chirp_Nm, band * chirp_Nm) << sheet.name;
  }
}

TEST(RandomWalk, IsThatOfItsSeed) {
  const auto run = [](std::uint64_t seed) {
    return simulate({.actuator = "dfki-120",
                     .experiment = "random-walk",
                     .seed = seed,
                     .duration_s = 10.0,
                     .with_truth = true});
  };
  const Recording first = run(3);
  const Recording again = run(3);
  for (const Channel& channel : first.channels())
    EXPECT_EQ(channel.values, again.channel(channel.name).values) << channel.name;
  const auto& one = first.channel("truth_torque_Nm").values;
  const Recording differing = run(4);
  const auto& other = differing.channel("truth_torque_Nm").values;
  EXPECT_GT(error_of(one, other).rmse, 5.0) << "not noise of the sensors alone";
}

TEST(BenchDeflectionLoop, RefusesAPlantThatItIsNotFor) {
  const auto message = [](const PlantParameters& plant) {
    return test::error_message([&] { BenchDeflectionLoop(plant, kRate_Hz); });
  };
  EXPECT_NE(message(plant_parameters(data_sheet("elastomer"))).find("is a spring"),
            std::string::npos);
  PlantParameters light = plant_parameters(data_sheet("dfki-50"));
  light.rotor_inertia_kg_m2 *= 0.1;
  EXPECT_NE(message(light).find("faster than the loop's bandwidth"), std::string::npos);
}

TEST(BenchDeflectionLoop, StopsItsIntegralAtThePeakCurrentAndForgetsItOnReset) {
  const PlantParameters plant = plant_parameters(data_sheet("dfki-50"));
  BenchDeflectionLoop loop(plant, kRate_Hz);
  const double at_once_A = loop.step(1.0, 0.0);
  double current_A = 0.0;
  for (int i = 0; i < 100000; ++i) current_A = loop.step(1.0, 0.0);
  EXPECT_NEAR(current_A - at_once_A, plant.motor.peak_current_A, 0.02 * at_once_A);
  EXPECT_EQ(loop.step(BenchDeflectionLoop::kLargest_rad, 0.0), current_A)
      << "1 rad was cut to 9 deg";
  loop.reset();
  EXPECT_EQ(loop.step(1.0, 0.0), at_once_A);
}

TEST(BenchTorqueLoop, RefusesAStiffnessWithoutGains) {
  const PlantParameters plant = plant_parameters(data_sheet("elastomer"));
  for (const double stiffness_Nm_rad : {0.0, 250.0, std::nan("")}) {
    EXPECT_NE(test::error_message([&] {
                BenchTorqueLoop(plant, stiffness_Nm_rad, kRate_Hz);
              }).find("0 < Nm/rad < 200"),
              std::string::npos);
  }
}

TEST(BenchTorqueLoop, StopsItsIntegralAtThePeakCurrentAndForgetsItOnReset) {
  const PlantParameters plant = plant_parameters(data_sheet("elastomer"));
  BenchTorqueLoop loop(plant, 100.0, kRate_Hz);
  const double at_once_A = loop.step(5.0, 0.0, 0.0);
  double current_A = 0.0;
  for (int i = 0; i < 10000; ++i) current_A = loop.step(5.0, 0.0, 0.0);
  EXPECT_NEAR(current_A - at_once_A, plant.motor.peak_current_A, 0.05 * at_once_A);
  loop.reset();
  EXPECT_EQ(loop.step(5.0, 0.0, 0.0), at_once_A);
}

}  // namespace
}  // namespace torsio
