#include "torsio/sim/closed_loop/tracking_score.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "sim/closed_loop/tracking_parts.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/error.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;

Recording record_of(std::vector<double> wanted, std::vector<double> torque,
                    std::vector<double> limited = {}) {
  Recording record("made up", kRate_Hz);
  std::vector<double> none(wanted.size(), 0.0);
  limited.resize(wanted.size(), 0.0);
  record.add({.name = "wanted_torque_Nm", .values = std::move(wanted)});
  record.add({.name = "truth_torque_Nm", .values = torque});
  for (double& value : torque) value += 0.5;
  record.add({.name = "torque_Nm", .values = std::move(torque)});
  record.add({.name = "is_limited_1", .values = std::move(limited)});
  for (const char* name : {"inverse_fault_1", "fault_1"})
    record.add({.name = name, .values = none});
  return record;
}

TEST(TrackingScore, MeasuresTheErrorAfterTwoSecondsWithAndWithoutTheLoadCell) {
  std::vector<double> wanted(4000, 10.0);
  std::vector<double> torque(4000, 10.0);
  for (std::size_t i = 0; i < 2000; ++i) torque[i] = 0.0;
  for (std::size_t i = 2000; i < 4000; ++i) torque[i] += i % 2 == 0 ? 1.0 : -3.0;
  const TrackingScore score = tracking_score(record_of(wanted, torque), 10.0, false);
  EXPECT_NEAR(score.mad, 2.0, 1e-12);
  EXPECT_NEAR(score.std_abs, 1.0, 1e-12);
  EXPECT_NEAR(score.rmse, std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(score.error_ratio, 0.2, 1e-12);
  EXPECT_NEAR(score.load_cell_mad, 2.0, 1e-12);
  EXPECT_NEAR(score.load_cell_rmse, std::sqrt(4.25), 1e-12);
  EXPECT_FALSE(score.overshoot);
}

TEST(TrackingScore, ReportsTheLargestOvershootOfASetOfSteps) {
  std::vector<double> wanted(6000, 4.0);
  std::vector<double> torque(6000, 4.0);
  torque[100] = 5.0;  // 1 of 4
  for (std::size_t i = 3000; i < 6000; ++i) wanted[i] = torque[i] = -6.0;
  torque[3500] = -9.0;  // 3 of 10
  const TrackingScore score = tracking_score(record_of(wanted, torque), 6.0, true);
  ASSERT_TRUE(score.overshoot);
  EXPECT_NEAR(*score.overshoot, 0.3, 1e-12);
}

TEST(TrackingScore, HasNoOvershootOfAStepThatIsNone) {
  std::vector<double> wanted(4000, 0.0);
  std::vector<double> torque(4000, 0.1);
  for (std::size_t i = 2000; i < 4000; ++i) wanted[i] = torque[i] = 4.0;
  torque[3000] = 5.0;
  EXPECT_EQ(tracking_score(record_of(wanted, torque), 4.0, true).overshoot, 0.25);
}

TEST(TrackingScore, CountsTheLimitsOfWhatItScores) {
  const std::vector<double> wanted(4000, 10.0);
  std::vector<double> limited(4000, 0.0);
  for (const int begin : {0, 1500, 2500, 3000})
    std::fill_n(limited.begin() + begin, begin == 1500 ? 600 : 10, 1.0);
  const TrackingScore score = tracking_score(record_of(wanted, wanted, limited), 10.0, false);
  EXPECT_EQ(score.limit_events, 2U);
  EXPECT_NEAR(score.limited_s, 0.12, 1e-12);
}

TEST(TrackingScore, RefusesARunThatIsOverBeforeItCounts) {
  const std::vector<double> none(1500, 0.0);
  EXPECT_NE(test::error_message([&] {
              (void)tracking_score(record_of(none, none), 1.0, false);
            }).find("more than 2 s"),
            std::string::npos);
}

TEST(Bandwidth, OfALowPassIsItsCutOff) {
  const LogSweep::Parameters sweep{
      .amplitude = 5.0, .start_Hz = 1.0, .end_Hz = 40.0, .duration_s = 20.0};
  LogSweep reference(sweep, kRate_Hz);
  Lowpass lowpass(8.0, kRate_Hz);
  std::vector<double> torque;
  std::vector<double> exact;
  for (int n = 0; n < 20000; ++n) {
    exact.push_back(reference.step());
    torque.push_back(1.0 + lowpass.step(exact.back()));
  }
  const double found = bandwidth(torque, sweep, kRate_Hz);
  EXPECT_NEAR(found, 8.0, 0.25);
  EXPECT_EQ(bandwidth(exact, sweep, kRate_Hz), std::numeric_limits<double>::infinity());
  for (double& value : exact) value *= 0.6;
  EXPECT_EQ(bandwidth(exact, sweep, kRate_Hz), 0.0);
}

}  // namespace
}  // namespace torsio
