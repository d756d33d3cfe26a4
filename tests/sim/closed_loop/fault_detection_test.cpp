#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sim/closed_loop/spring_sheet.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/closed_loop/tracking.hpp"
#include "torsio/sim/closed_loop/tracking_score.hpp"

namespace torsio {
namespace {

using test::kSheet;
using testing::HasSubstr;

/// 100 ticks at 10 Hz of a loop with this error from tick `begin` on, and these reported faults.
Recording run_of(double error_Nm, std::size_t begin, const std::vector<std::size_t>& inverse_faults,
                 const std::vector<std::size_t>& loop_faults = {}) {
  constexpr std::size_t kTicks = 100;
  Recording run("run", 10.0);
  std::vector<double> torque_Nm(kTicks, 0.0);
  for (std::size_t n = begin; n < kTicks; ++n) torque_Nm[n] = -error_Nm;
  std::vector<double> inverse(kTicks, 0.0);
  std::vector<double> loop(kTicks, 0.0);
  for (const std::size_t n : inverse_faults)
    inverse[n] = static_cast<double>(Fault::outside_training_range);
  for (const std::size_t n : loop_faults) loop[n] = static_cast<double>(Fault::input_not_finite);
  run.add({.name = "wanted_torque_Nm", .values = std::vector<double>(kTicks, 0.0)});
  run.add({.name = "truth_torque_Nm", .values = torque_Nm});
  run.add({.name = "inverse_fault_1", .values = inverse});
  run.add({.name = "fault_1", .values = loop});
  return run;
}

FaultSchedule jump_at(double start_s, std::optional<double> duration_s = {}) {
  return {.faults = {{.what = "gear_angle_rad",
                      .kind = FaultKind::jump,
                      .start_s = start_s,
                      .duration_s = duration_s,
                      .amount = rad_from_deg(2.0)}}};
}

TrackingSpec spec_of(double duration_s, FaultSchedule faults) {
  TrackingSpec spec;
  spec.reference.duration_s = duration_s;
  spec.measures_bandwidth = false;
  spec.faults = std::move(faults);
  return spec;
}

TEST(FaultDetections, HaveTheTimeOfDetectionAndTheErrorUntilThen) {
  const auto found = fault_detections(jump_at(3.0, 4.0), kSheet, run_of(33.0, 40, {50, 51, 90}),
                                      run_of(1.0, 0, {}));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].what, "gear_angle_rad jump");
  EXPECT_EQ(found[0].start_s, 3.0);
  EXPECT_EQ(found[0].end_s, 7.0);
  EXPECT_EQ(found[0].detected_s, 5.0);
  EXPECT_EQ(found[0].detected_as, Fault::outside_training_range);
  EXPECT_EQ(found[0].largest_unreported_error_Nm, 33.0);
  EXPECT_EQ(found[0].error_without_fault_Nm, 1.0);
}

TEST(FaultDetections, LeaveErrorsUnderAReportedFaultOut) {
  std::vector<std::size_t> reported;
  for (std::size_t n = 40; n < 100; ++n) reported.push_back(n);
  const auto found =
      fault_detections(jump_at(3.0), kSheet, run_of(33.0, 40, {}, reported), run_of(0.0, 0, {}));
  EXPECT_EQ(found.at(0).detected_as, Fault::input_not_finite) << "of the loop";
  EXPECT_EQ(found.at(0).largest_unreported_error_Nm, 0.0);
  EXPECT_FALSE(found.at(0).end_s);
}

TEST(FaultDetections, AFaultThatIsReportedWithoutTheInjectedOneIsNoDetection) {
  const Recording sound = run_of(1.0, 0, {50});
  EXPECT_FALSE(
      fault_detections(jump_at(3.0), kSheet, run_of(33.0, 40, {50}), sound).at(0).detected_s);
  // Nor one before it, or after its end.
  EXPECT_FALSE(fault_detections(jump_at(3.0, 1.0), kSheet, run_of(33.0, 40, {29, 40}), sound)
                   .at(0)
                   .detected_s);
  EXPECT_TRUE(fault_detections(jump_at(60.0), kSheet, run_of(0.0, 0, {}), sound).empty())
      << "the loop was stopped before it";
}

// The case of the docs: a jump of an encoder that the range of the deflection contains.
TEST(Track, ReportsThatAnEncoderJumpWasNotDetected) {
  const TrackingSpec spec = spec_of(8.0, jump_at(4.0));
  const std::array<std::uint64_t, 2> seeds{1, 2};
  const auto rows = track_models(kSheet, spec, LinearInverse(600.0), {}, seeds);
  ASSERT_EQ(rows.size(), 2U);
  ASSERT_EQ(rows[0].faults.size(), 1U);
  const FaultDetection& jump = rows[0].faults[0];
  EXPECT_FALSE(jump.detected_s);
  EXPECT_GT(*jump.largest_unreported_error_Nm, 10.0);
  EXPECT_LT(*jump.error_without_fault_Nm, 4.0);
  const std::string text = tracking_text(rows);
  EXPECT_THAT(text, HasSubstr("UNDETECTED: linear reports no fault in 2 of 2 runs with "
                              "gear_angle_rad jump (from 4 s)"));
  const auto json = nlohmann::json::parse(tracking_json(rows)).at("results").at(0).at("faults");
  EXPECT_EQ(json.at(0).at("detected"), false);
  EXPECT_TRUE(json.at(0).at("detected_s").is_null());
  EXPECT_GT(json.at(0).at("largest_unreported_error_Nm"), 10.0);
}

TEST(Track, ReportsWhenANaNWasDetected) {
  TrackingSpec spec = spec_of(6.0, {});
  spec.faults.faults = {
      {.what = "gear_angle_rad", .kind = FaultKind::nan, .start_s = 4.0, .duration_s = 0.02}};
  const std::array<std::uint64_t, 1> seeds{1};
  const auto rows = track_models(kSheet, spec, LinearInverse(600.0), {}, seeds);
  const FaultDetection& lost = rows.at(0).faults.at(0);
  ASSERT_TRUE(lost.detected_s);
  EXPECT_NEAR(*lost.detected_s, 4.0, 0.002);
  EXPECT_EQ(lost.detected_as, Fault::input_not_finite);
  EXPECT_THAT(tracking_text(rows), testing::Not(HasSubstr("UNDETECTED")));
  // Nothing without a schedule.
  spec.faults = {};
  const auto sound = track_models(kSheet, spec, LinearInverse(600.0), {}, seeds);
  EXPECT_TRUE(sound.at(0).faults.empty());
  EXPECT_THAT(tracking_text(sound), testing::Not(HasSubstr("injected")));
}

}  // namespace
}  // namespace torsio
