#include "joint_load/load_motion.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "joint_load/fit_load_facts.hpp"
#include "joint_load/local_quartic.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using test::error_message;
using testing::HasSubstr;

constexpr double kRate_Hz = 1000.0;

double at_s(std::size_t n) { return static_cast<double>(n) / kRate_Hz; }

/// A swing with its second derivative, known exactly.
struct Swing {
  std::vector<double> angle_rad;
  std::vector<double> acceleration_rad_s2;
};

Swing swing(std::size_t samples, double frequency_Hz, double noise_rad, std::uint64_t seed = 1) {
  Random random(seed);
  const double w = 2.0 * std::numbers::pi * frequency_Hz;
  Swing made;
  for (std::size_t n = 0; n < samples; ++n) {
    made.angle_rad.push_back(std::sin(w * at_s(n)) + noise_rad * random.normal());
    made.acceleration_rad_s2.push_back(-w * w * std::sin(w * at_s(n)));
  }
  return made;
}

/// RMS of the error of q'' where it is known.
double error_of(const Swing& made, std::size_t half_width) {
  const LoadMotion motion = load_motion(made.angle_rad, half_width, kRate_Hz);
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t n = 0; n < motion.acceleration_rad_s2.size(); ++n) {
    if (!std::isfinite(motion.acceleration_rad_s2[n])) continue;
    sum += std::pow(motion.acceleration_rad_s2[n] - made.acceleration_rad_s2[n], 2);
    count += 1.0;
  }
  return std::sqrt(sum / count);
}

TEST(LocalQuartic, IsExactForAPolynomialOfOrderFour) {
  std::vector<double> values;
  for (int i = 0; i < 41; ++i) {
    const double t = at_s(static_cast<std::size_t>(i)) - 0.02;
    values.push_back(2.0 - 3.0 * t + 5.0 * t * t - 40.0 * t * t * t + 900.0 * t * t * t * t);
  }
  const LocalQuartic quartic(20, kRate_Hz);
  EXPECT_NEAR(quartic.value(values, 20), 2.0, 1e-12);
  EXPECT_NEAR(quartic.curvature(values, 20), 10.0, 1e-7);
}

TEST(LocalQuartic, KnowsTheVarianceThatNoiseLeaves) {
  Random random(4);
  std::vector<double> noise(20000);
  for (double& value : noise) value = random.normal();
  const LocalQuartic wide(15, kRate_Hz);
  const LocalQuartic narrow(10, kRate_Hz);
  double squares = 0.0;
  double of_difference = 0.0;
  double count = 0.0;
  for (std::size_t n = 15; n + 15 < noise.size(); ++n) {
    const double curvature = wide.curvature(noise, n);
    squares += curvature * curvature;
    of_difference += std::pow(curvature - narrow.curvature(noise, n), 2);
    count += 1.0;
  }
  EXPECT_NEAR(squares / count / wide.curvature_variance(), 1.0, 0.05);
  EXPECT_NEAR(of_difference / count / wide.variance_of_difference(narrow), 1.0, 0.05);
}

TEST(LoadMotion, DoesNotReachTheEnds) {
  const LoadMotion motion = load_motion(swing(100, 1.0, 0.0).angle_rad, 10, kRate_Hz);
  EXPECT_TRUE(std::isnan(motion.acceleration_rad_s2[9]));
  EXPECT_TRUE(std::isfinite(motion.acceleration_rad_s2[10]));
  EXPECT_TRUE(std::isfinite(motion.acceleration_rad_s2[89]));
  EXPECT_TRUE(std::isnan(motion.acceleration_rad_s2[90]));
}

TEST(LoadMotion, ChoosesAWidthWhoseErrorIsNearlyTheLeastAndStatesIt) {
  for (const auto& [frequency_Hz, noise_rad] :
       {std::pair{0.5, 1e-5}, std::pair{3.0, 1e-5}, std::pair{3.0, 4e-4}}) {
    const Swing made = swing(20000, frequency_Hz, noise_rad);
    const WeightedAngle angle{made.angle_rad, 1.0};
    const std::size_t chosen = choose_half_width({&angle, 1}, kRate_Hz);
    double least = error_of(made, 4);
    for (double width = 5.0; width < 400.0; width *= 1.1)
      least = std::min(least, error_of(made, static_cast<std::size_t>(width)));
    EXPECT_LT(error_of(made, chosen), 1.25 * least) << frequency_Hz << " Hz, " << noise_rad;
    const double stated = std::sqrt(acceleration_error(made.angle_rad, chosen, kRate_Hz).square());
    EXPECT_NEAR(stated / error_of(made, chosen), 1.0, 0.25) << frequency_Hz << " Hz, " << noise_rad;
  }
}

TEST(LoadMotion, DoesNotTakeAMotionForLostNoise) {
  // A slow swing with short fast strokes: polynomials of half a second miss these altogether, and agree again.
  Random random(8);
  Swing made;
  for (std::size_t n = 0; n < 40000; ++n) {
    const double w = 2.0 * std::numbers::pi * 3.0;
    const double t = std::fmod(at_s(n), 10.0) - 5.0;
    const double envelope = std::exp(-t * t / 0.08);
    made.angle_rad.push_back(std::sin(0.3 * at_s(n)) + 0.05 * envelope * std::sin(w * t) +
                             1e-5 * random.normal());
    const double slope = -2.0 * t / 0.08;
    const double curvature = slope * slope - 2.0 / 0.08;
    made.acceleration_rad_s2.push_back(
        -0.09 * std::sin(0.3 * at_s(n)) +
        0.05 * envelope *
            ((curvature - w * w) * std::sin(w * t) + 2.0 * slope * w * std::cos(w * t)));
  }
  const WeightedAngle angle{made.angle_rad, 1.0};
  const std::size_t chosen = choose_half_width({&angle, 1}, kRate_Hz);
  EXPECT_LT(chosen, 60U);
  EXPECT_LT(error_of(made, chosen), 1.5 * error_of(made, 25));
  EXPECT_GT(std::sqrt(acceleration_error(made.angle_rad, 400, kRate_Hz).square()),
            0.3 * error_of(made, 400));
}

TEST(LoadMotion, BridgesSamplesAtWhichTheEncoderDidNotDeliver) {
  Recording recording("sweep", kRate_Hz);
  recording.add({"joint_angle_rad", {0.0, 0.0, 0.0, 0.3, 0.3}, {1, 0, 0, 1, 0}});
  const std::vector<double> angle_rad = load_angle(recording);
  EXPECT_NEAR(angle_rad[1], 0.1, 1e-12);
  EXPECT_NEAR(angle_rad[2], 0.2, 1e-12);
  EXPECT_NEAR(angle_rad[3], 0.3, 1e-12);
}

TEST(LoadMotion, RefusesAnAngleThatJumpsOrIsMissing) {
  Recording recording("sweep", kRate_Hz);
  recording.add({"gear_angle_rad", {0.0, 0.1, 0.2}});
  EXPECT_THAT(error_message([&] { (void)load_angle(recording); }),
              HasSubstr("the channel joint_angle_rad"));
  recording.add({"joint_angle_rad", {3.1, 3.14, -3.13}});
  EXPECT_THAT(error_message([&] { (void)load_angle(recording); }), HasSubstr("t = 0.002 s"));
}

/// A stiff spring with a stop that carries a lever of known size; its output has an inertia of 0.2 kg m^2, and
/// the encoder is 1 deg off.
LoadedMotion loaded_motion(double length_m, std::uint64_t seed) {
  constexpr double kStiffness_Nm_rad = 500.0;
  constexpr std::size_t kHalfWidth = 15;
  LoadedMotion made{
      .recording = "lever " + std::to_string(length_m),
      .load = {.gravity_Nm = 90.0 * length_m, .inertia_kg_m2 = 9.0 * length_m * length_m},
      .half_width = kHalfWidth};
  Random random(seed);
  std::vector<double> measured_rad;
  for (std::size_t n = 0; n < 20000; ++n) {
    const double t = at_s(n);
    const double q = 2.0 * std::sin(0.9 * t) + 0.1 * std::sin(9.0 * t);
    const double acceleration = -1.62 * std::sin(0.9 * t) - 8.1 * std::sin(9.0 * t);
    const double torque_Nm =
        made.load.gravity_Nm * std::sin(q) + (made.load.inertia_kg_m2 + 0.2) * acceleration;
    made.deflection.push_back(torque_Nm / kStiffness_Nm_rad + 1e-5 * random.normal());
    measured_rad.push_back(q - std::numbers::pi / 180.0 + 1e-5 * random.normal());
  }
  made.motion = load_motion(measured_rad, kHalfWidth, kRate_Hz);
  return made;
}

LoadSheet sheet_that_fits() {
  return parse_load_sheet(
      "load: {pendulum: {mass: 9kg, length: 0.1m}, joint_inertia: fit, zero: fit}", "load.yaml");
}

TEST(FitLoadFacts, FindsInertiaAndZeroFromTheAgreementOfTheLevers) {
  const std::vector<LoadedMotion> motions = {loaded_motion(0.1, 1), loaded_motion(0.17, 2),
                                             loaded_motion(0.25, 3)};
  const FittedFacts facts = fit_load_facts(motions, sheet_that_fits());
  EXPECT_NEAR(facts.joint_inertia_kg_m2.value, 0.2, 0.01);
  EXPECT_NEAR(facts.zero_rad.value, std::numbers::pi / 180.0, 1e-3);
  EXPECT_GT(facts.joint_inertia_kg_m2.standard_error, 0.0);
  EXPECT_LT(facts.joint_inertia_kg_m2.standard_error, 0.02);
}

TEST(FitLoadFacts, RefusesOneLeverAlone) {
  const std::vector<LoadedMotion> motions = {loaded_motion(0.2, 1), loaded_motion(0.2, 2)};
  EXPECT_THAT(error_message([&] { (void)fit_load_facts(motions, sheet_that_fits()); }),
              HasSubstr("all recordings have the same load"));
}

}  // namespace
}  // namespace torsio
