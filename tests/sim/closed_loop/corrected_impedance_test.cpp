// Impedances whose torque an estimate corrects.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "ideal_tube.hpp"
#include "model/linear/linear.hpp"
#include "sim/bench/bench.hpp"
#include "sim/closed_loop/impedance_loop.hpp"
#include "support/error_message.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/report/tracking.hpp"

namespace torsio {
namespace {

/// An estimate that is k times the twist of a tube, of so many ticks each.
ImpedanceModel exact_model(const DataSheet& sheet, int ticks) {
  const auto tube = tube_impedance_settings(sheet, TubeImpedance::kZero);
  const double per_twist_Nm_rad = tube.drive.ratio / tube.tube_ratio * tube.tube_Nm_rad;
  Linear::Parameters parameters;
  parameters.coefficients.values = Matrix(1, 2);
  parameters.coefficients.values.values = {0.0, per_twist_Nm_rad};
  EstimatorSettings settings{
      .features = {.inputs = {"motor_angle_rad / 2 - wave_generator_angle_rad"}, .definitions = {}},
      .sample_rate_Hz = kBenchRate_Hz / ticks,
      .target = "torque_Nm",
      .zeroed_channels = {},
      .ranges = {.lowest = {-1.0}, .highest = {1.0}},
      .fallback = {.slope = {per_twist_Nm_rad}, .residual_std = 1.0},
      .residuals = {}};
  return {.name = "exact",
          .use = Estimator(std::move(settings), AnyModel(Linear(parameters))),
          .reason = "the test takes its estimate"};
}

ImpedanceSpec wanted(double stiffness_Nm_rad, double damping_Nms_rad) {
  return {.kind = ImpedanceSpec::Kind::wanted,
          .stiffness_Nm_rad = stiffness_Nm_rad,
          .damping_Nms_rad = damping_Nms_rad,
          .duration_s = 10.0};
}

/// Whether the motion after a push of the motor decays.
bool settles(const ImpedancePlan& plan, bool is_locked) {
  constexpr double kDuration_s = 30.0;
  constexpr double kPush_A = 0.2;
  const FaultSchedule none;
  const Load load{.is_locked = is_locked};
  Bench bench(
      *plan.sheet,
      {.name = "push", .duration_s = kDuration_s, .seed = 1, .conditions = {}, .faults = none},
      {.start = load, .load_cell = LoadCell::external, .duration_s = kDuration_s, .next = {}});
  ImpedanceLoop loop(plan);
  std::vector<double> speeds;
  double last_rad = 0.0;
  for (int tick = 0; tick < static_cast<int>(kDuration_s * kBenchRate_Hz); ++tick) {
    const Measurement measured = bench.sense();
    const double current_A = loop.step(bench.time_s(), measured).current_A;
    speeds.push_back(
        std::abs(std::exchange(last_rad, measured.motor_angle_rad) - measured.motor_angle_rad));
    bench.act({.command = {.current_A = current_A + (tick < 20 ? kPush_A : 0.0)}, .load = load});
  }
  const auto largest = [&](double from_s, double to_s) {
    return *std::max_element(speeds.begin() + static_cast<int>(from_s * kBenchRate_Hz),
                             speeds.begin() + static_cast<int>(to_s * kBenchRate_Hz));
  };
  return largest(20.0, 30.0) < 0.02 * largest(0.1, 2.0);
}

class HeldEstimate : public testing::TestWithParam<int> {};

// Without the hold the linear loop would be stable up to 21 rad/s with any number of ticks: to twice the limit of 200
// ticks and to five times that of 500.
TEST_P(HeldEstimate, HasTheStabilityLimitOfTheSimulatedLoop) {
  DataSheet sheet = test::ideal_tube();
  std::get<GearSheet>(sheet.second).stiffness_Nm_rad =
      assumed(1e8);  // rigid, as in the linear loop
  const ImpedanceModel model = exact_model(sheet, GetParam());
  ImpedancePlan plan = impedance_plan(sheet, wanted(500.0, 20.0), &model, LinearInverse(1.0));
  ASSERT_EQ(plan.ticks_per_estimate(), static_cast<std::size_t>(GetParam()));
  const auto is_stable_at = [&](double bandwidth_rad_s) {
    plan.correction.bandwidth_rad_s = bandwidth_rad_s;
    return LinearImpedance(plan).is_stable();
  };
  double low_rad_s = 0.1;
  double high_rad_s = 100.0;
  ASSERT_TRUE(is_stable_at(low_rad_s));
  ASSERT_FALSE(is_stable_at(high_rad_s));
  for (int n = 0; n < 30; ++n) {
    const double middle_rad_s = std::sqrt(low_rad_s * high_rad_s);
    (is_stable_at(middle_rad_s) ? low_rad_s : high_rad_s) = middle_rad_s;
  }
  constexpr double kTolerance = 0.1;
  plan.correction.bandwidth_rad_s = (1.0 - kTolerance) * low_rad_s;
  EXPECT_TRUE(settles(plan, true) && settles(plan, false)) << low_rad_s << " rad/s";
  plan.correction.bandwidth_rad_s = (1.0 + kTolerance) * low_rad_s;
  EXPECT_FALSE(settles(plan, true) && settles(plan, false)) << low_rad_s << " rad/s";
}

INSTANTIATE_TEST_SUITE_P(Ticks, HeldEstimate, testing::Values(1, 40, 200, 500),
                         [](const auto& each) { return fmt::format("{}", each.param); });

TEST(CorrectedImpedance, RefusesABandwidthThatIsImpossibleOrHasNoEffect) {
  const DataSheet sheet = data_sheet("harmonic-drive");
  const ImpedanceModel model = exact_model(sheet, 1);
  const auto refusal = [&](double correction_rad_s, const std::optional<ImpedanceModel>& use) {
    ImpedanceSpec spec = wanted(500.0, 20.0);
    spec.correction_rad_s = correction_rad_s;
    return test::error_message([&] { (void)track_impedance(sheet, spec, use, 1); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double impossible : {nan, 0.0, -1.0, 100.1, infinity}) {
    const std::string message = refusal(impossible, model);
    EXPECT_NE(
        message.find("impedance bandwidth of the correction: expected above 0 and at most 100 "
                     "rad/s, found "),
        std::string::npos)
        << message;
  }
  const std::string useless = "it has no effect: no estimate of a model corrects the torque";
  EXPECT_NE(refusal(3.0, std::nullopt).find(useless), std::string::npos);
  const ImpedanceModel inverse{.name = "line", .use = AnyInverse(LinearInverse(60.0))};
  const DataSheet spring = data_sheet("dfki-50");
  ImpedanceSpec spec = wanted(20.0, 2.0);
  spec.correction_rad_s = 3.0;
  const std::string refused =
      test::error_message([&] { (void)track_impedances(spring, spec, std::vector{inverse}, 1); });
  EXPECT_NE(refused.find(useless), std::string::npos) << refused;
}

TEST(CorrectedImpedance, StatesTheBandwidthOfTheCorrection) {
  const DataSheet sheet = data_sheet("harmonic-drive");
  const std::vector<ImpedanceModel> models = {exact_model(sheet, 1)};
  ImpedanceSpec spec = wanted(500.0, 20.0);
  const std::vector<ImpedanceRun> runs = track_impedances(sheet, spec, models, 1);
  EXPECT_EQ(runs.front().correction_rad_s, std::nullopt);
  EXPECT_EQ(runs.back().correction_rad_s, EstimateCorrection::Settings{}.bandwidth_rad_s);
  spec.correction_rad_s = 3.0;
  const ImpedanceRun slow = track_impedances(sheet, spec, models, 1).back();
  EXPECT_EQ(slow.correction_rad_s, 3.0);
  EXPECT_NE(impedance_text(slow).find("below 0.477 Hz"), std::string::npos);
  EXPECT_NE(impedance_json(slow).find("\"correction_rad_s\": 3.0"), std::string::npos);
  EXPECT_NE(impedance_json(runs.front()).find("\"correction_rad_s\": null"), std::string::npos);
}

// A joint that is to run free is a loop as every other with an estimate in it.
TEST(CorrectedImpedance, IsCheckedWithoutAStiffnessToo) {
  for (const char* tube : {"harmonic-drive", "harmonic-drive:soft", "harmonic-drive:rigid"}) {
    const DataSheet sheet = data_sheet(tube);
    ImpedanceSpec spec{.kind = ImpedanceSpec::Kind::zero, .duration_s = 10.0};
    const auto refusal = [&](double correction_rad_s, int ticks) {
      spec.correction_rad_s = correction_rad_s;
      return test::error_message(
          [&] { (void)track_impedance(sheet, spec, exact_model(sheet, ticks), 1); });
    };
    const std::string fast = refusal(100.0, 1);
    EXPECT_NE(fast.find("impedance correction: not passive up to 10 Hz; expected at most "),
              std::string::npos)
        << tube << ": " << fast;
    const std::size_t at = fast.find("at most ");
    ASSERT_NE(at, std::string::npos) << tube << ": " << fast;
    const double proposed_rad_s = std::stod(fast.substr(at + std::string("at most ").size()));
    EXPECT_EQ(refusal(proposed_rad_s, 1), "") << tube << ": " << fast;
    const std::string slow = refusal(100.0, 100);
    EXPECT_NE(slow.find("each estimate held for 100 ms"), std::string::npos)
        << tube << ": " << slow;
  }
}

TEST(CorrectedImpedance, StatesThatTheGainsOfThePaperAreNotChecked) {
  const DataSheet sheet = data_sheet("harmonic-drive");
  const std::string words = "whether the correction by the estimate is stable is not checked";
  const ImpedanceSpec high{.kind = ImpedanceSpec::Kind::high, .duration_s = 10.0};
  const ImpedanceRun run = track_impedance(sheet, high, exact_model(sheet, 1), 1);
  EXPECT_NE(impedance_text(run).find(words), std::string::npos);
  EXPECT_EQ(impedance_text(track_impedance(sheet, high, 1)).find(words), std::string::npos);
}

}  // namespace
}  // namespace torsio
