#include "fit/grey_box/late_target.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "fit/common/model_run.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

constexpr double kLateRate_Hz = 500.0;
constexpr GreyBoxOptions kBoxWithoutNetwork{.residual = ResidualKind::none};

/// A progressive spring with a little dry friction. The torque arrives `late` samples after it acted; a damping may be positive
/// on one side and negative on the other, which a lag is not.
Sequence late_spring_record(double speed, std::size_t late, double damping_Nms_rad,
                            std::uint64_t seed) {
  Random random(seed);
  const double phase = 7.0 * random.uniform();
  constexpr std::size_t kSamples = 8000;
  std::vector<double> torque;
  Sequence record{.recording = "spring", .features = Matrix(kSamples, 2)};
  double before = 0.0;
  double stop = 0.0;
  for (std::size_t n = 0; n < kSamples; ++n) {
    const double t = speed * static_cast<double>(n) / kLateRate_Hz + phase;
    const double twist = 0.05 * std::sin(1.3 * t) + 0.03 * std::sin(2.9 * t + 1.0);
    const double rate = n > 0 ? (twist - before) * kLateRate_Hz : 0.0;
    if (n > 0) stop = std::clamp(stop + twist - before, -0.002, 0.002);
    before = twist;
    record.features(n, 0) = twist;
    record.features(n, 1) = rate;
    torque.push_back(200.0 * twist + 30000.0 * twist * twist * twist + 10.0 * stop +
                     damping_Nms_rad * rate * twist / 0.08);
    record.target.push_back(torque[n - std::min(n, late)] + 0.02 * random.normal());
  }
  record.use.assign(kSamples, 1);
  std::fill_n(record.use.begin(), 20, std::uint8_t{0});
  return record;
}

TrainingData late_spring_data(std::size_t late, double damping_Nms_rad,
                              const std::vector<double>& speeds = {0.5, 0.8, 1.2}) {
  TrainingData data;
  data.inputs = {{.expression = "twist_rad"}, {.expression = "twist_rate_rad_s", .is_rate = true}};
  data.target = "torque_Nm";
  data.sample_rate_Hz = kLateRate_Hz;
  for (std::size_t k = 0; k < speeds.size(); ++k)
    data.sequences.push_back(late_spring_record(speeds[k], late, damping_Nms_rad, k + 1));
  return data;
}

std::string notes_of(const Fitted<GreyBox>& fitted) {
  std::string all;
  for (const std::string& note : fitted.notes) all += note + "\n";
  return all;
}

TargetLag lag_of(const TrainingData& data) {
  constexpr double kRateShare = 0.2;
  const GreyBoxSearch search(data, "", kRateShare);
  return find_target_lag(data, "", kRateShare, search.choose(false, {}).choice, {});
}

/// Error against the torque as it acts, in a motion much faster than those of the training.
double error_when_fast(const Fitted<GreyBox>& fitted) {
  const TrainingData fast = late_spring_data(0, 0.0, {12.0});
  const Sequence& record = fast.sequences[0];
  GreyBox box(fitted.parameters);
  double sum = 0.0;
  for (std::size_t n = 0; n < record.target.size(); ++n) {
    const double error = box.step(record.features.row(n)).value - record.target[n];
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(record.target.size()));
}

TEST(LateTarget, IsNotCompensatedByABankOverARate) {
  const Fitted<GreyBox> fitted = fit_grey_box(late_spring_data(5, 0.0), kBoxWithoutNetwork);
  EXPECT_FALSE(has_bank_over_rate(fitted.parameters.terms, late_spring_data(5, 0.0)))
      << notes_of(fitted);
  EXPECT_THAT(notes_of(fitted), testing::ContainsRegex("torque_Nm is late by about 1[01] ms"));
  EXPECT_THAT(notes_of(fitted), testing::ContainsRegex("latency: \\{torque_Nm: 1[01]ms\\}"));
}

TEST(LateTarget, LeavesABankThatATorqueOfTheRateNeeds) {
  const TrainingData data = late_spring_data(0, 2.0);
  const Fitted<GreyBox> fitted = fit_grey_box(data, kBoxWithoutNetwork);
  EXPECT_TRUE(has_bank_over_rate(fitted.parameters.terms, data)) << notes_of(fitted);
}

TEST(LateTarget, PredictsFastMotionsWhereTheLatencyIsTakenOut) {
  const TrainingData late = late_spring_data(5, 0.0);
  const auto lag = std::lround(lag_of(late).samples);
  ASSERT_EQ(lag, 5);
  const TrainingData corrected = late_spring_data(static_cast<std::size_t>(5 - lag), 0.0);
  const Fitted<GreyBox> fitted = fit_grey_box(corrected, kBoxWithoutNetwork);
  EXPECT_THAT(notes_of(fitted), testing::Not(HasSubstr("is late by")));
  EXPECT_FALSE(has_bank_over_rate(fitted.parameters.terms, corrected)) << notes_of(fitted);
  EXPECT_LT(error_when_fast(fitted), 0.5);
  EXPECT_GT(error_when_fast(fit_grey_box(late, kBoxWithoutNetwork)), 1.0);
}

TEST(LateTarget, FindsTheLag) {
  for (const std::size_t late : {std::size_t{0}, std::size_t{1}, std::size_t{5}, std::size_t{9}}) {
    const TrainingData delayed = late_spring_data(late, 0.0);
    const TargetLag lag = lag_of(delayed);
    EXPECT_NEAR(lag.samples, static_cast<double>(late), 0.5) << late;
  }
}

TEST(LateTarget, IsALoadOnly) {
  TrainingData data = late_spring_data(5, 0.0);
  data.target = "spring_deflection_rad";
  const Fitted<GreyBox> fitted = fit_grey_box(data, kBoxWithoutNetwork);
  EXPECT_THAT(notes_of(fitted), testing::Not(HasSubstr("is late by")));
}

}  // namespace
}  // namespace torsio
