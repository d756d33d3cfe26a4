#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

constexpr double kRate_Hz = 200.0;
constexpr double kStiffness_Nm_rad = 1134.0;
constexpr double kLoad_Nm = 45.0;
constexpr DeflectionTorque kTruth{-1.007, -923.6, 43.0, 8.9038};

constexpr std::size_t kCoefficients = 4;
std::array<double, kCoefficients> values(const DeflectionTorque& of) {
  return {of.offset_Nm, of.stiffness_Nm_rad, of.viscous_Nms_rad, of.coulomb_Nm};
}

/// A joint that swings with two frequencies, up to 24 deg/s, and lifts a lever.
struct Swing {
  std::vector<double> deflection_rad = {};
  std::vector<double> speed_rad_s = {};
  std::vector<double> motor_Nm = {};

  explicit Swing(double duration_s) {
    const double slow = 2.0 * std::numbers::pi * 0.07;
    const double fast = 2.0 * std::numbers::pi * 0.19;
    for (int n = 0; n < static_cast<int>(duration_s * kRate_Hz); ++n) {
      const double t = n / kRate_Hz;
      const double angle_rad = 0.5 + 0.5 * std::sin(slow * t) + 0.17 * std::sin(fast * t);
      const double speed = 0.5 * slow * std::cos(slow * t) + 0.17 * fast * std::cos(fast * t);
      deflection_rad.push_back(-kLoad_Nm * std::sin(angle_rad) / kStiffness_Nm_rad);
      speed_rad_s.push_back(speed);
      motor_Nm.push_back(kTruth.offset_Nm + kTruth.stiffness_Nm_rad * deflection_rad.back() +
                         kTruth.viscous_Nms_rad * speed +
                         kTruth.coulomb_Nm * MotorReferencedTorques::coulomb_regressor(speed));
    }
  }

  /// Noise of a standard deviation and a correlation time: autoregressive of first order.
  void add_noise(double std_dev_Nm, double correlation_s, std::uint64_t seed) {
    Random random(seed);
    const double kept = std::exp(-1.0 / (kRate_Hz * correlation_s));
    double noise = random.normal();
    for (double& torque : motor_Nm) {
      torque += std_dev_Nm * noise;
      noise = kept * noise + std::sqrt(1.0 - kept * kept) * random.normal();
    }
  }

  [[nodiscard]] TorqueRegressionData data() const {
    return {.name = "swing",
            .deflection_rad = deflection_rad,
            .joint_speed_rad_s = speed_rad_s,
            .motor_Nm = motor_Nm,
            .sample_rate_Hz = kRate_Hz};
  }
};

TEST(FitDeflectionTorque, IsExactWithoutNoise) {
  const DeflectionTorqueFit fit = fit_deflection_torque(Swing(30.0).data());
  const auto found = values(fit.coefficients);
  const auto truth = values(kTruth);
  for (std::size_t j = 0; j < kCoefficients; ++j) {
    EXPECT_NEAR(found[j], truth[j], 1e-9 * std::abs(truth[j])) << "p" << j;
    EXPECT_LT(values(fit.standard_errors)[j], 1e-9 * std::abs(truth[j])) << "p" << j;
  }
  EXPECT_LT(fit.rmse_Nm, 1e-10);
}

TEST(FitDeflectionTorque, ReportsTheConditionOfItsColumns) {
  const DeflectionTorqueFit fit = fit_deflection_torque(Swing(60.0).data());
  EXPECT_GE(fit.condition_number, 1.0);
  // The deflection is a few degrees beside speeds of 20 deg/s: without scaling it is larger.
  EXPECT_GT(fit.unscaled_condition_number, fit.condition_number);
}

DeflectionTorqueFit noisy_fit(double correlation_s, std::uint64_t bootstrap_seed = 1) {
  Swing swing(120.0);
  swing.add_noise(2.0, correlation_s, 7);
  return fit_deflection_torque(swing.data(), {.seed = bootstrap_seed});
}

TEST(FitDeflectionTorque, HasLargerErrorsWhereTheNoiseIsCorrelated) {
  const auto white = values(noisy_fit(0.0005).standard_errors);
  const DeflectionTorqueFit fit = noisy_fit(0.1);
  const auto coloured = values(fit.standard_errors);
  // Noise of 0.1 s has 40 times the covariance, sqrt(40) = 6.3; less for columns that vary quickly.
  for (std::size_t j = 0; j < kCoefficients; ++j)
    EXPECT_GT(coloured[j], 4.0 * white[j]) << "p" << j;
  EXPECT_NEAR(fit.effective_samples, 120.0 / 0.2, 120.0);
  EXPECT_GT(fit.block_s, 3.0 * 0.1);
  EXPECT_NEAR(fit.rmse_Nm, 2.0, 0.2);
}

TEST(FitDeflectionTorque, IsDeterministicForASeed) {
  EXPECT_EQ(noisy_fit(0.1).standard_errors, noisy_fit(0.1).standard_errors);
  EXPECT_NE(noisy_fit(0.1).standard_errors, noisy_fit(0.1, 2).standard_errors);
  EXPECT_EQ(noisy_fit(0.1).coefficients, noisy_fit(0.1, 2).coefficients);
}

TEST(FitDeflectionTorque, HasNoErrorsOfARecordWithTooFewIndependentSamples) {
  Swing swing(10.0);
  swing.add_noise(2.0, 2.0, 3);
  const DeflectionTorqueFit fit = fit_deflection_torque(swing.data());
  EXPECT_TRUE(std::isnan(fit.standard_errors.offset_Nm));
  EXPECT_TRUE(std::isfinite(fit.coefficients.offset_Nm));
}

std::string refusal(const TorqueRegressionData& data, const TorqueRegressionOptions& options = {}) {
  return test::error_message([&] { (void)fit_deflection_torque(data, options); });
}

TEST(FitDeflectionTorque, RefusesRecordsThatDoNotDetermineACoefficient) {
  Swing held(30.0);
  held.deflection_rad.assign(held.deflection_rad.size(), 0.01);
  EXPECT_THAT(refusal(held.data()), HasSubstr("does not determine p1"));
  EXPECT_THAT(refusal(held.data()), HasSubstr("under a load that varies"));
  Swing resting(30.0);
  resting.speed_rad_s.assign(resting.speed_rad_s.size(), 0.0);
  EXPECT_THAT(refusal(resting.data()), HasSubstr("while it moves in both directions"));
  Swing steady(30.0);
  for (double& speed : steady.speed_rad_s) speed = speed > 0.0 ? 0.2 : -0.2;
  EXPECT_THAT(refusal(steady.data()), HasSubstr("does not determine p3"));
}

TEST(FitDeflectionTorque, RefusesWhatItCannotUse) {
  const Swing few(0.05);
  EXPECT_THAT(refusal(few.data()), HasSubstr("at least 20, 5 for each coefficient"));
  Swing broken(1.0);
  broken.deflection_rad[17] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(broken.data()), HasSubstr("swing: sample 17"));
  Swing shorter(1.0);
  shorter.motor_Nm.pop_back();
  EXPECT_THAT(refusal(shorter.data()), HasSubstr("of equal length"));
  EXPECT_THAT(refusal(Swing(1.0).data(), {.resamples = 5}), HasSubstr("resamples"));
  TorqueRegressionData timeless = few.data();
  timeless.sample_rate_Hz = 0.0;
  EXPECT_THAT(refusal(timeless), HasSubstr("sample rate"));
}

/// Share of the coefficients within two standard errors.
double coverage(double duration_s, double correlation_s, std::size_t seeds) {
  const Swing sound(duration_s);
  const auto truth = values(kTruth);
  std::size_t within = 0;
  for (std::size_t seed = 1; seed <= seeds; ++seed) {
    Swing noisy = sound;
    noisy.add_noise(2.0, correlation_s, seed);
    const DeflectionTorqueFit fit =
        fit_deflection_torque(noisy.data(), {.resamples = 400, .seed = 1000 + seed});
    for (std::size_t j = 0; j < kCoefficients; ++j)
      if (std::abs(values(fit.coefficients)[j] - truth[j]) <= 2.0 * values(fit.standard_errors)[j])
        ++within;
  }
  return static_cast<double>(within) / static_cast<double>(seeds * kCoefficients);
}

TEST(FitDeflectionTorque, HasItsErrorsWithinTwoStandardErrorsIn95PercentOfTheCoefficients) {
  for (const double correlation_s : {0.001, 0.02, 0.05, 0.1, 0.2})
    EXPECT_NEAR(coverage(60.0, correlation_s, 100), 0.95, 0.03) << correlation_s << " s";
}

/// A recording whose motor torque is (18) and (19) exactly, with the speed that a differentiator
/// gives.
Recording exact_recording(const MotorReferencedTorques::Parameters& truth) {
  const Swing swing(20.0);
  Differentiator rate(kRate_Hz, TorqueRegressionOptions().speed_cutoff_Hz);
  std::array<std::vector<double>, 4> columns;
  double joint_rad = 0.3;
  for (std::size_t n = 0; n < swing.motor_Nm.size(); ++n) {
    joint_rad += swing.speed_rad_s[n] / kRate_Hz;
    const double speed = rate.step(joint_rad);
    const double friction_Nm =
        truth.spring.viscous_Nms_rad * speed +
        truth.spring.coulomb_Nm * MotorReferencedTorques::coulomb_regressor(speed);
    const double load_Nm = kTruth.stiffness_Nm_rad * swing.deflection_rad[n];
    const double gear_rad =
        joint_rad - (load_Nm - truth.spring.offset_Nm) / truth.spring.stiffness_Nm_rad;
    columns[1].push_back(gear_rad);
    columns[0].push_back(truth.gear_ratio * (gear_rad - (load_Nm - truth.gear.offset_Nm) /
                                                            truth.gear.stiffness_Nm_rad));
    columns[2].push_back(joint_rad);
    columns[3].push_back((load_Nm + friction_Nm) / (truth.torque_constant_Nm_A * truth.gear_ratio));
  }
  Recording recording("exact", kRate_Hz);
  recording.add({.name = "motor_angle_rad", .values = columns[0]});
  recording.add({.name = "gear_angle_rad", .values = columns[1]});
  recording.add({.name = "joint_angle_rad", .values = columns[2]});
  recording.add({.name = "motor_current_A", .values = columns[3]});
  return recording;
}

TEST(FitMotorReferencedTorques, FindsBothRegressionsOfARecording) {
  const DeflectionTorque spring{-1.0, -1000.0, 40.0, 9.0};
  const MotorReferencedTorques::Parameters truth{.torque_constant_Nm_A = 0.18,
                                                 .gear_ratio = 120.0,
                                                 .gear = {36.0, -30000.0, 40.0, 9.0},
                                                 .spring = spring};
  const MotorReferencedFit fit = fit_motor_referenced_torques(exact_recording(truth), 0.18, 120.0);
  for (std::size_t j = 0; j < kCoefficients; ++j) {
    EXPECT_NEAR(values(fit.parameters.spring)[j] / values(truth.spring)[j], 1.0, 1e-7) << "p" << j;
    EXPECT_NEAR(values(fit.parameters.gear)[j] / values(truth.gear)[j], 1.0, 1e-6) << "p" << j;
  }
  EXPECT_EQ(fit.parameters.spring, fit.spring.coefficients);
  EXPECT_EQ(fit.parameters.gear, fit.gear.coefficients);
  EXPECT_EQ(fit.parameters.torque_constant_Nm_A, 0.18);
}

TEST(FitMotorReferencedTorques, RefusesRecordingsWithoutASensorAndImpossibleDrives) {
  const MotorReferencedTorques::Parameters truth{.torque_constant_Nm_A = 0.18,
                                                 .gear_ratio = 120.0,
                                                 .gear = {36.0, -30000.0, 40.0, 9.0},
                                                 .spring = {-1.0, -1000.0, 40.0, 9.0}};
  const Recording complete = exact_recording(truth);
  Recording without_motor("no motor", kRate_Hz);
  for (const Channel& channel : complete.channels())
    if (channel.name != "motor_angle_rad") without_motor.add(channel);
  EXPECT_THAT(
      test::error_message([&] { (void)fit_motor_referenced_torques(without_motor, 0.18, 120.0); }),
      HasSubstr("motor_angle_rad"));
  EXPECT_THAT(
      test::error_message([&] { (void)fit_motor_referenced_torques(complete, 0.18, -1.0); }),
      HasSubstr("gear_ratio"));
}

}  // namespace
}  // namespace torsio
