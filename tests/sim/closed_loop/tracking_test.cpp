#include "torsio/sim/closed_loop/tracking.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "data/resample.hpp"
#include "model/grey_box/grey_box.hpp"
#include "sim/closed_loop/spring_sheet.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/actuator/joint_parameters.hpp"
#include "torsio/core/error.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/report/tracking.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::kInfinity;
using test::kSheet;

/// What the sweeps of dfki-50 give, roughly.
LinearInverse line() { return LinearInverse(600.0); }

TrackingSpec short_spec(TorqueReference::Kind kind = TorqueReference::Kind::chirp) {
  return {.reference = {.kind = kind, .duration_s = 12.0}, .measures_bandwidth = false};
}

/// Two chirps of the deflection loop, output locked, as recordings to learn from, either way round.
Dataset torque_mode() {
  Dataset dataset;
  for (const double amplitude_Nm : {15.0, 8.0}) {
    Recording chirp = simulate({.actuator = "dfki-50",
                                .experiment = "chirp",
                                .seed = 11,
                                .duration_s = 30.0,
                                .torque_amplitude_Nm = amplitude_Nm});
    add_derived(chirp, {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}});
    const std::size_t samples = chirp.size();
    dataset.records.push_back({std::move(chirp), whole_record(samples, Role::train)});
  }
  return dataset;
}

ModelFile fitted(Dataset dataset, const std::string& family, const std::vector<std::string>& inputs,
                 const std::string& target = "torque_Nm") {
  dataset.target = target;
  return train_model(dataset, {.family = family, .features = resolve_inputs(dataset, inputs)}, 1)
      .file;
}

TEST(Track, WithALineFollowsWithinTheSpringsFriction) {
  for (const JointOutput output : {JointOutput::locked, JointOutput::free}) {
    TrackingSpec spec = short_spec();
    spec.output = output;
    const TrackingRun run = track(kSheet, spec, line(), 1);
    EXPECT_FALSE(run.has_diverged);
    EXPECT_EQ(run.record.size(), 12000U);
    EXPECT_LT(run.score.mad, 2.0);
    EXPECT_GT(run.score.mad, 0.2) << "the inner friction of the spring is 1.36 Nm";
    EXPECT_NEAR(run.score.rmse * run.score.rmse,
                run.score.mad * run.score.mad + run.score.std_abs * run.score.std_abs, 1e-9);
    EXPECT_NEAR(run.score.load_cell_mad, run.score.mad, 0.1);
    EXPECT_EQ(run.score.limit_events, 0U);
    EXPECT_EQ(run.score.loop_faults + run.score.inverse_faults, 0U);
    EXPECT_FALSE(run.score.limit_cycle);
  }
}

TEST(Track, RecordsTermsThatAddUpToTheCommand) {
  TrackingSpec spec = short_spec();
  spec.friction = FrictionCompensation{.share = 0.3};
  spec.observer_cutoff_Hz = 2.0;
  spec.feeds_rate_forward = true;
  const Recording record = track(kSheet, spec, line(), 1).record;
  const auto at = [&](const char* channel, std::size_t i) {
    return record.channel(channel).values[i];
  };
  double max_rest = 0.0;
  double max_friction = 0.0;
  double max_observer = 0.0;
  double max_forward = 0.0;
  for (std::size_t i = 0; i < record.size(); ++i) {
    double sum = 0.0;
    for (const char* term :
         {"proportional_current_A", "integral_current_A", "derivative_current_A",
          "feed_forward_current_A", "rate_feed_forward_current_A", "friction_current_A",
          "observer_current_A", "transfer_current_A", "rest_current_A"})
      sum += at(term, i);
    ASSERT_NEAR(sum, at("command_current_A", i), 1e-12);
    if (at("is_limited_1", i) == 0.0)
      max_rest = std::max(max_rest, std::abs(at("rest_current_A", i)));
    max_friction = std::max(max_friction, std::abs(at("friction_current_A", i)));
    max_observer = std::max(max_observer, std::abs(at("observer_current_A", i)));
    max_forward = std::max(max_forward, std::abs(at("rate_feed_forward_current_A", i)));
  }
  EXPECT_LT(max_rest, 1e-12);
  EXPECT_GT(max_friction, 0.01);
  EXPECT_GT(max_observer, 0.01);
  EXPECT_GT(max_forward, 0.01);
}

TEST(Track, FollowsNoiseFasterThanTheLoopWhereItsRateIsFedForward) {
  TrackingSpec spec = short_spec(TorqueReference::Kind::random_walk);
  const double plain_Nm = track(kSheet, spec, line(), 1).score.rmse;
  spec.feeds_rate_forward = true;
  EXPECT_LT(track(kSheet, spec, line(), 1).score.rmse, 0.6 * plain_Nm);
}

TEST(Track, AModelFilesInverseBeatsTheLineWhereItLearned) {
  const std::vector<std::string> inputs{"spring_deflection_rad",
                                        "lowpass(rate(spring_deflection_rad), 10Hz)"};
  const AnyInverse inverse = inverse_of(fitted(torque_mode(), "linear_coulomb", inputs));
  const std::array<NamedInverse, 1> models{NamedInverse{"coulomb", inverse}};
  const std::array<std::uint64_t, 2> seeds{3, 4};
  TrackingSpec spec = short_spec();
  spec.reference.duration_s = 30.0;
  const auto rows = track_models(kSheet, spec, line(), models, seeds);
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0].mad_to_linear, 1.0);
  EXPECT_EQ(rows[3].model, "coulomb");
  EXPECT_EQ(rows[3].seed, 4U);
  EXPECT_NEAR(rows[3].mad_to_linear.value(), rows[3].score.mad / rows[2].score.mad, 1e-12);
  EXPECT_LT(rows[3].mad_to_linear.value(), 0.9);
}

TEST(Track, AModelThatWasTrainedTheOtherWayRoundClosesTheLoopToo) {
  const ModelFile model =
      fitted(torque_mode(), "linear", {"torque_Nm", "lowpass(rate(joint_angle_rad), 10Hz)"},
             "spring_deflection_rad");
  const TrackingRun run = track(kSheet, short_spec(), inverse_of(model), 1);
  EXPECT_LT(run.score.mad, 2.0);
}

TEST(Track, AContinuousModelOfAnotherRateIsDiscretisedAnew) {
  ModelFile model = fitted(torque_mode(), "linear", {"spring_deflection_rad"});
  const auto mad_of = [&](double sample_period_s) {
    GreyBox::Parameters box;
    box.terms = {.curve_knots = {-0.1, 0.1},
                 .thresholds = {},
                 .friction_knots = {0.0},
                 .time_constants_s = {0.05},
                 .rate_scales = {0.0},
                 .sample_period_s = sample_period_s};
    box.coefficients.values = Matrix(1, box.terms.columns());
    box.coefficients.values.values = {-57.0, 57.0, 200.0, 0.0, 0.0};
    model.parameters = box;
    return track(kSheet, short_spec(), inverse_of(model), 1).score.mad;
  };
  EXPECT_EQ(mad_of(0.005), mad_of(0.001));
}

TEST(Track, MeasuresTheBandwidthThatTheGainsWereMadeFor) {
  TrackingSpec spec = short_spec();
  spec.measures_bandwidth = true;
  // |s² + 2 ζ ω s + ω²| = √2 ω² at 0.746 ω for ζ = 0.9; friction takes some.
  const auto slow = track(kSheet, spec, line(), 1).bandwidth_Hz;
  ASSERT_TRUE(slow);
  EXPECT_NEAR(*slow, 5.9, 1.5);
  spec.bandwidth_rad_s = 80.0;
  const auto fast = track(kSheet, spec, line(), 1).bandwidth_Hz;
  ASSERT_TRUE(fast);
  EXPECT_GT(*fast, 1.3 * *slow);
}

TEST(Track, OfStepsReportsTheOvershoot) {
  const TrackingScore score =
      track(kSheet, short_spec(TorqueReference::Kind::steps), line(), 1).score;
  ASSERT_TRUE(score.overshoot);
  EXPECT_LT(*score.overshoot, 0.5);
}

TEST(Track, CountsLimitsWhereTheCurrentIsNotEnough) {
  TrackingSpec spec = short_spec(TorqueReference::Kind::steps);
  spec.reference.amplitude_Nm = 48.0;
  spec.bandwidth_rad_s = 100.0;
  const TrackingScore score = track(kSheet, spec, line(), 1).score;
  EXPECT_GT(score.limit_events, 0U);
  EXPECT_GT(score.limited_s, 0.0);
}

TEST(Track, IsTheSameForTheSameSeed) {
  const Recording one =
      track(kSheet, short_spec(TorqueReference::Kind::random_walk), line(), 7).record;
  const Recording other =
      track(kSheet, short_spec(TorqueReference::Kind::random_walk), line(), 7).record;
  const Recording third =
      track(kSheet, short_spec(TorqueReference::Kind::random_walk), line(), 8).record;
  EXPECT_EQ(one.channel("command_current_A").values, other.channel("command_current_A").values);
  EXPECT_NE(one.channel("command_current_A").values, third.channel("command_current_A").values);
}

TEST(Track, WithoutASensorFadesTheCurrentAndGoesOn) {
  TrackingSpec spec = short_spec();
  spec.faults = parse_fault_schedule(
      "faults:\n  - {sensor: joint_angle_rad, fault: nan, at: 5s, for: 0.5s}\n", "faults", kSheet);
  const TrackingRun run = track(kSheet, spec, line(), 1);
  EXPECT_EQ(run.score.loop_faults, 500U);
  EXPECT_FALSE(run.has_diverged);
  const auto& command = run.record.channel("command_current_A").values;
  EXPECT_NEAR(command[5490], 0.0, 1e-6);
  for (const double current_A : command) ASSERT_TRUE(std::isfinite(current_A));
  const auto& wanted = run.record.channel("wanted_torque_Nm").values;
  const auto& torque = run.record.channel("truth_torque_Nm").values;
  for (std::size_t i = 7000; i < wanted.size(); ++i) ASSERT_NEAR(torque[i], wanted[i], 4.0);
}

TEST(Track, StopsARunWhoseLeverTurnsRound) {
  TrackingSpec spec = short_spec();
  spec.output = JointOutput::free;
  const LinearInverse far_too_soft(50.0);
  EXPECT_TRUE(track(kSheet, spec, far_too_soft, 1).has_diverged);
  const std::array<NamedInverse, 1> models{NamedInverse{"soft", far_too_soft}};
  const std::array<std::uint64_t, 1> seeds{1};
  const auto rows = track_models(kSheet, spec, line(), models, seeds);
  EXPECT_EQ(rows[0].status, "ok");
  EXPECT_EQ(rows[1].status, "diverged");
  EXPECT_NE(rows[1].reason.find("stopped after"), std::string::npos);
  EXPECT_FALSE(rows[1].mad_to_linear);
}

TEST(Track, RefusesWhatItCannotRunBeforeTheFirstStep) {
  const auto refusal = [](const DataSheet& sheet, const TrackingSpec& spec) {
    return error_message([&] { (void)track(sheet, spec, line(), 1); });
  };
  EXPECT_NE(refusal(data_sheet("elastomer"), short_spec()).find("series-elastic"),
            std::string::npos);
  TrackingSpec far = short_spec();
  far.reference.amplitude_Nm = 60.0;
  EXPECT_NE(refusal(kSheet, far).find("rated for"), std::string::npos);
  TrackingSpec swung = short_spec();
  swung.output = JointOutput::free;
  swung.lever_m = 0.1;
  EXPECT_NE(refusal(kSheet, swung).find("would tip the lever over"), std::string::npos);
  TrackingSpec wild = short_spec();
  wild.bandwidth_rad_s = 3000.0;
  EXPECT_NE(refusal(kSheet, wild).find("margin"), std::string::npos);
}

TEST(Track, RefusesModelsThatTheLoopCannotFeed) {
  const auto refusal = [](const ModelFile& model) {
    return error_message([&] { (void)inverse_of(model); });
  };
  Dataset dataset = torque_mode();
  for (DatasetRecord& record : dataset.records)
    record.recording.add_condition("support_m", &record == &dataset.records.front() ? 0.03 : 0.04);
  ModelFile unknown = fitted(dataset, "linear", {"spring_deflection_rad", "support_m"});
  EXPECT_NE(refusal(unknown).find("support_m"), std::string::npos);
  ModelFile zeroed = fitted(dataset, "linear", {"spring_deflection_rad"});
  zeroed.settings.zeroed_channels = {"gear_angle_rad"};
  EXPECT_EQ(refusal(zeroed), "") << "the zeros of simulated encoders are 0";
  const ModelFile one_way = fitted(dataset, "mlp", {"spring_deflection_rad"});
  EXPECT_NE(refusal(one_way).find("--target spring_deflection_rad"), std::string::npos);
  for (DatasetRecord& record : dataset.records) {
    record.recording = resample(record.recording, 100.0);
    record.segments = whole_record(record.recording.size(), Role::train);
  }
  const ModelFile slow = fitted(dataset, "arx", {"torque_Nm"}, "spring_deflection_rad");
  EXPECT_NE(refusal(slow).find("100 Hz, at which"), std::string::npos) << refusal(slow);
}

TEST(TrackingReport, HasTheFieldsOfItsSchemaAndNoNumbersOfARunThatFailed) {
  const std::array<std::uint64_t, 1> seeds{1};
  std::vector<TrackingRow> rows = track_models(kSheet, short_spec(), line(), {}, seeds);
  rows.push_back(rows.front());
  rows.back().model = "m";
  rows.back().status = "failed";
  rows.back().reason = "why";
  const auto json = nlohmann::ordered_json::parse(tracking_json(rows));
  const auto& row = json.at("results").at(0);
  auto field = row.begin();  // the fields of the schema, in its order; others follow
  for (const char* key :
       {"actuator", "variant", "output", "reference", "amplitude_Nm", "model", "seed", "mad",
        "std_abs", "rmse", "mad_to_linear", "bandwidth_Hz", "limit_events", "status", "reason"})
    EXPECT_EQ((field++).key(), key);
  EXPECT_EQ(row.at("output"), "locked");
  EXPECT_EQ(row.at("variant"), "maxwell-slip");
  EXPECT_EQ(row.at("status"), "ok");
  EXPECT_TRUE(row.at("bandwidth_Hz").is_null());
  EXPECT_TRUE(json.at("results").at(1).at("mad").is_null());
  const std::string text = tracking_text(rows);
  EXPECT_NE(text.find("chirp of 13 Nm"), std::string::npos) << text;
  EXPECT_NE(text.find("m, seed 1: failed: why"), std::string::npos) << text;
}

// Never down to -3 dB is the best result, down from the start the worst, and none is neither.
TEST(TrackingReport, DistinguishesABandwidthAboveTheSweepBelowItAndNone) {
  TrackingRow row;
  row.model = "m";
  std::vector<TrackingRow> rows(4, row);
  rows[0].bandwidth_Hz = 6.0;
  rows[1].bandwidth_Hz = kInfinity;
  rows[2].bandwidth_Hz = 0.0;
  for (std::size_t n = 0; n < rows.size(); ++n) rows[n].seed = n + 1;
  const auto json = nlohmann::json::parse(tracking_json(rows)).at("results");
  const std::array<const char*, 4> outcomes{"measured", "above_sweep", "below_sweep",
                                            "not_measured"};
  for (std::size_t n = 0; n < rows.size(); ++n) {
    EXPECT_EQ(json.at(n).at("bandwidth"), outcomes.at(n));
    EXPECT_EQ(json.at(n).at("bandwidth_Hz").is_null(), n > 0);
  }
  const std::string text = tracking_text(rows);
  EXPECT_NE(text.find("6.00"), std::string::npos) << text;
  EXPECT_NE(text.find("m, seed 2: bandwidth above the sweep"), std::string::npos) << text;
  EXPECT_NE(text.find("m, seed 3: bandwidth below the sweep"), std::string::npos) << text;
}

// Paper 000, section 4: the limits override the torque loop, and the run continues.
TEST(Tracking, KeepsTheMotorSideWithinItsLimits) {
  const DataSheet sheet = data_sheet("dfki-50");
  const LinearInverse linear(series_elastic_joint(sheet).stiffness_Nm_rad);
  TrackingSpec spec = {
      .output = JointOutput::free,
      .lever_m = 0.3,
      .reference = {.kind = TorqueReference::Kind::steps, .amplitude_Nm = 3.0, .duration_s = 10.0},
      .measures_bandwidth = false};
  const DriveRange unlimited = track(sheet, spec, linear, 1).drive;
  spec.limits = DriveLimits{.lowest_rad = -0.10, .highest_rad = 0.12, .speed_rad_s = 0.5};
  ASSERT_GT(unlimited.highest_rad, 0.12) << "the limits matter";
  ASSERT_GT(unlimited.fastest_rad_s, 0.5);
  for (const auto actuation :
       {DeflectionController::Actuation::current, DeflectionController::Actuation::velocity}) {
    spec.actuation = actuation;
    const TrackingRun run = track(sheet, spec, linear, 1);
    EXPECT_FALSE(run.has_diverged);
    EXPECT_GE(run.drive.lowest_rad, -0.10);
    EXPECT_LE(run.drive.highest_rad, 0.12);
    EXPECT_LE(run.drive.fastest_rad_s, 0.5);
    EXPECT_GT(run.score.limited_s, 0.1);
    const std::vector<double>& limit = run.record.channel("limit_1").values;
    EXPECT_NE(std::ranges::count(limit, static_cast<double>(JointCascade::Limit::position)), 0);
  }
}

// Paper 000 found the deflection controller on the velocity loop less responsive and prone to
// oscillate. So it is with a velocity loop of the same bandwidth: the phase margin is smaller, and
// with that of the loop on the current the torque follows worse.
TEST(Tracking, IsCloseToOscillationOrSluggishOnASlowVelocityLoop) {
  const DataSheet sheet = data_sheet("dfki-50");
  const SeriesElasticJoint joint = series_elastic_joint(sheet);
  const auto phase_deg = [&](DeflectionController::Settings settings) {
    settings.joint = joint;
    const DeflectionController loop(settings, 1000.0);
    return deg_from_rad(loop.margins_of(loop.gains(), JointOutput::free).phase_rad);
  };
  constexpr auto kVelocity = DeflectionController::Actuation::velocity;
  constexpr double kEqual_rad_s = 17.5;  // bandwidth for an equal phase margin
  const auto on_velocity_deg = [&](double velocity_rad_s, double bandwidth_rad_s) {
    return phase_deg({.actuation = kVelocity,
                      .bandwidth_rad_s = bandwidth_rad_s,
                      .speed_loop = JointCascade::gains_for(joint.drive, velocity_rad_s).velocity});
  };
  const double on_current_deg = phase_deg({.bandwidth_rad_s = 50.0});
  EXPECT_LT(on_velocity_deg(50.0, 50.0), on_current_deg - 15.0);
  EXPECT_NEAR(on_velocity_deg(50.0, kEqual_rad_s), on_current_deg, 0.3);
  // The table of docs/simulation/tracking.md, which no command prints.
  EXPECT_NEAR(on_current_deg, 55.4, 0.1);
  EXPECT_NEAR(on_velocity_deg(30.0, 10.0), 67.6, 0.1);
  EXPECT_NEAR(on_velocity_deg(50.0, 10.0), 66.2, 0.1);
  EXPECT_NEAR(on_velocity_deg(50.0, kEqual_rad_s), 55.4, 0.1);
  EXPECT_NEAR(on_velocity_deg(50.0, 25.0), 48.1, 0.1);
  EXPECT_NEAR(on_velocity_deg(50.0, 50.0), 34.6, 0.1);
  EXPECT_NEAR(on_velocity_deg(200.0, 50.0), 43.6, 0.1);

  const LinearInverse linear(joint.stiffness_Nm_rad);
  TrackingSpec spec = {.reference = {.kind = TorqueReference::Kind::steps, .duration_s = 8.0},
                       .measures_bandwidth = false};
  const double mad_on_current = track(sheet, spec, linear, 1).score.mad;
  spec.actuation = kVelocity;
  spec.velocity_rad_s = 50.0;
  spec.bandwidth_rad_s = kEqual_rad_s;
  EXPECT_GT(track(sheet, spec, linear, 1).score.mad, 1.1 * mad_on_current);
}
}  // namespace
}  // namespace torsio
