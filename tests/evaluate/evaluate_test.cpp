#include "torsio/evaluate/evaluate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "evaluate/trained.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "support/fitted_families.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/families.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

using test::trained;

TEST(Evaluate, FindsTheNoiseThatARightModelCannotExplain) {
  const Dataset dataset = test::bench_dataset();
  Estimator estimator = make_estimator(trained(dataset, "linear_coulomb").file);
  const SplitScore score = evaluate(estimator, dataset, Role::test);
  ASSERT_EQ(score.recordings.size(), 1U);
  EXPECT_EQ(score.recordings.front().recording, "held out");
  EXPECT_LT(score.together.metrics.rmse, 0.4);
  EXPECT_GT(score.together.metrics.rmse, 0.05);
  EXPECT_EQ(score.together.metrics.samples + score.together.initialised_samples,
            dataset.records.back().recording.size());
}

TEST(Evaluate, CountsHowOftenTheTruthIsWithinTheErrorBar) {
  const Dataset dataset = test::bench_dataset();
  ModelFile file = trained(dataset, "linear_coulomb").file;
  const Score estimate = evaluate(make_estimator(file), dataset, Role::test).together;
  EXPECT_GT(estimate.within_std_dev, 0.5);
  EXPECT_GT(estimate.within_2_std_dev, estimate.within_std_dev);
  for (double& std_dev : file.settings.residuals.std_dev) std_dev *= 2.0;
  const Score wider = evaluate(make_estimator(file), dataset, Role::test).together;
  EXPECT_EQ(wider.within_std_dev, estimate.within_2_std_dev);
  EXPECT_GT(estimate.mean_std_dev, 0.05);
  EXPECT_EQ(wider.mean_std_dev, 2.0 * estimate.mean_std_dev);
  EXPECT_LT(estimate.without_std_dev, 0.5);
  file.settings.residuals = {};
  const Score without = evaluate(make_estimator(file), dataset, Role::test).together;
  EXPECT_TRUE(std::isnan(without.within_std_dev));
  EXPECT_TRUE(std::isnan(without.mean_std_dev));
  EXPECT_EQ(without.without_std_dev, 1.0);
}

TEST(Evaluate, CoverageIsWithoutTheErrorThatTheSensorOfTheTrainingHasInTheTest) {
  Dataset dataset = test::bench_dataset();
  ModelFile file = trained(dataset, "linear_coulomb").file;
  const Score plain = evaluate(make_estimator(file), dataset, Role::test).together;
  file.settings.target_uncertainty = {.constant = 3.0, .relative = 0.05};
  const std::vector<ScoredRun> runs = scored_runs(make_estimator(file), dataset);
  const Score stated = evaluate(runs, Role::test).together;
  EXPECT_NEAR(stated.mean_std_dev, plain.mean_std_dev, 1e-9);
  EXPECT_NEAR(stated.within_std_dev, plain.within_std_dev, 1e-3);
  EXPECT_NEAR(stated.within_2_std_dev, plain.within_2_std_dev, 1e-3);
  EXPECT_GT(runs.back().prediction.estimates.back().std_dev, 3.0);

  // A known load and another sensor do not have it.
  dataset.load_target = {.file = "load.yaml"};
  EXPECT_GT(evaluate(make_estimator(file), dataset, Role::test).together.mean_std_dev, 3.0);
  dataset.load_target = {};
  for (DatasetRecord& record : dataset.records) {
    Channel other = record.recording.channel(dataset.target);
    other.name = "other_torque_Nm";
    record.recording.add(std::move(other));
  }
  dataset.target = "other_torque_Nm";
  EXPECT_GT(evaluate(make_estimator(file), dataset, Role::test).together.mean_std_dev, 3.0);
}

TEST(Evaluate, ScoresOnlyFreshSamples) {
  Dataset dataset = test::bench_dataset();
  Estimator estimator = make_estimator(trained(dataset, "linear").file);
  const std::size_t all = evaluate(estimator, dataset, Role::test).together.metrics.samples;

  const Recording& old = dataset.records.back().recording;
  Recording held("held", 1000.0);
  for (Channel channel : old.channels()) {
    if (channel.name == "torque_Nm")
      for (std::size_t i = 0; i < old.size(); ++i) channel.fresh.push_back(i % 8 == 0 ? 1 : 0);
    held.add(std::move(channel));
  }
  dataset.records.pop_back();
  test::add_record(dataset, std::move(held), Role::test);
  EXPECT_NEAR(
      static_cast<double>(evaluate(estimator, dataset, Role::test).together.metrics.samples),
      static_cast<double>(all) / 8.0, 1.0);
}

TEST(Evaluate, LeavesTheEmbargoOut) {
  Dataset dataset;
  Recording recording = test::bench_recording("blocks");
  const std::size_t samples = recording.size();
  dataset.records.push_back({std::move(recording), interleaved_blocks(samples, 10, 5, 50)});
  Estimator estimator = make_estimator(trained(dataset, "linear").file);
  const SplitScore score = evaluate(estimator, dataset, Role::test);
  EXPECT_EQ(score.together.metrics.samples, 2 * samples / 10);
}

class PredictEveryFamily : public testing::TestWithParam<std::string> {};

TEST_P(PredictEveryFamily, EqualsAnEstimatorThatIsFedSampleBySample) {
  const Dataset dataset = test::bench_dataset();
  const Recording recording = dataset.records.back().recording.part(0, 1000);
  const TrainedModel model = train_model(dataset,
                                         {.family = GetParam(),
                                          .options = test::quick_options(GetParam()),
                                          .features = resolve_inputs(dataset, {})},
                                         1);
  Estimator estimator = make_estimator(model.file);
  (void)predict(estimator, dataset.records.front().recording.part(0, 500));  // must leave no trace
  const Prediction offline = predict(estimator, recording);
  ASSERT_EQ(offline.estimates.size(), recording.size());

  Estimator in_the_loop = make_estimator(model.file);
  std::vector<double> raw(in_the_loop.raw_inputs().size());
  for (std::size_t n = 0; n < recording.size(); ++n) {
    for (std::size_t j = 0; j < raw.size(); ++j)
      raw[j] = recording.channel(in_the_loop.raw_inputs()[j]).values[n];
    const Estimate streamed = in_the_loop.step(raw);
    const Estimate& predicted = offline.estimates[n];
    ASSERT_EQ(predicted.value, streamed.value) << "sample " << n;
    ASSERT_EQ(predicted.fault, streamed.fault) << "sample " << n;
    ASSERT_TRUE(predicted.std_dev == streamed.std_dev ||
                (std::isnan(predicted.std_dev) && std::isnan(streamed.std_dev)))
        << "sample " << n;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryFamily, PredictEveryFamily,
                         testing::ValuesIn(test::spring_families()), test::kFamilyName);

TEST(Evaluate, SaysWhereAnInputIsMissing) {
  Dataset dataset = test::bench_dataset();
  Estimator estimator = make_estimator(trained(dataset, "linear").file);
  const Recording good = test::bench_recording("holes");
  Recording holes("holes", 1000.0);
  for (Channel channel : good.channels()) {
    if (channel.name == "gear_angle_rad")
      channel.values[123] = std::numeric_limits<double>::quiet_NaN();
    holes.add(std::move(channel));
  }
  const std::string message = test::error_message([&] { (void)predict(estimator, holes); });
  EXPECT_NE(message.find("holes: gear_angle_rad"), std::string::npos) << message;
  EXPECT_NE(message.find("t = 0.123 s"), std::string::npos) << message;
}

TEST(Evaluate, KnowsThatTheZerosOfRecordingsWereSubtracted) {
  Dataset dataset = test::bench_dataset();
  const SplitScore plain =
      evaluate(make_estimator(trained(dataset, "linear").file), dataset, Role::test);
  for (DatasetRecord& record : dataset.records)
    record.recording.zeros = {{.channel = "joint_angle_rad", .first_s = 0.1, .mid_range = false},
                              {.channel = "torque_Nm", .first_s = 0.1, .mid_range = false}};
  const TrainedModel model = trained(dataset, "linear");
  EXPECT_EQ(model.file.settings.zeroed_channels, std::vector<std::string>{"joint_angle_rad"})
      << "the target has no zero at run time";
  Estimator estimator = make_estimator(model.file);
  EXPECT_NE(test::error_message([&] {
              estimator.set_zero("joint_angel_rad", 0.7);
            }).find("Did you mean 'joint_angle_rad'?"),
            std::string::npos);
  estimator.set_zero("joint_angle_rad", 0.7);  // the robot's own
  const SplitScore score = evaluate(estimator, dataset, Role::test);
  EXPECT_EQ(score.together.guarded_samples, plain.together.guarded_samples);
  EXPECT_EQ(score.together.metrics.rmse, plain.together.metrics.rmse);
  EXPECT_EQ(
      predict(make_estimator(model.file), dataset.records[2].recording).estimates.back().fault,
      Fault::none);
}

TEST(EvaluateModel, SaysWhichInputLeavesTheTrainingByHowMuch) {
  const Dataset dataset = test::bench_dataset();
  const ModelFile file = trained(dataset, "linear_coulomb").file;
  EXPECT_THAT(evaluate_model(file, dataset).warnings, testing::IsEmpty());
  Dataset larger;
  larger.target = dataset.target;
  test::add_record(larger, test::bench_recording("larger", {.amplitude_rad = 0.09}), Role::test);
  const std::vector<std::string> warnings = evaluate_model(file, larger).warnings;
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_THAT(warnings[0], testing::StartsWith("spring_deflection_rad is -0.0"));
  EXPECT_THAT(warnings[0], testing::HasSubstr("add a training recording that covers this range"));
  EXPECT_THAT(warnings[1], testing::StartsWith("lowpass(spring_deflection_rate_rad_s, 10Hz) is"));
  EXPECT_THAT(warnings[1], testing::HasSubstr("moves 3.0 times as fast"));
  const std::vector<ScoredRun> runs = scored_runs(make_estimator(file), larger);
  EXPECT_EQ(evaluate_model(file, larger, runs).warnings, warnings);
}

/// A spring that becomes stiffer, with the zeros of an angle and of the torque moved.
Recording stiffening(const std::string& name, std::uint64_t seed, double amplitude_rad,
                     double cubic_Nm_rad3, double angle_rad = 0.0, double torque_Nm = 0.0) {
  const Recording bench = test::bench_recording(
      name, {.friction_Nm = 0.05, .amplitude_rad = amplitude_rad, .seed = seed});
  const std::vector<double> gear = bench.channel("gear_angle_rad").values;
  const std::vector<double> joint = bench.channel("joint_angle_rad").values;
  return test::changed(bench, [&](Channel& channel) {
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      if (channel.name == "joint_angle_rad") channel.values[i] += angle_rad;
      if (channel.name == "torque_Nm")
        channel.values[i] += cubic_Nm_rad3 * std::pow(gear[i] - joint[i], 3) + torque_Nm;
    }
  });
}

/// The warnings of a model of that spring on a recording with such zeros.
std::vector<std::string> zero_warnings(double cubic_Nm_rad3, double angle_rad, double torque_Nm) {
  Dataset training;
  test::add_record(training, stiffening("first", 1, 0.04, cubic_Nm_rad3), Role::train);
  const ModelFile file = trained(training, "polynomial").file;
  Dataset later;
  test::add_record(later, stiffening("later", 3, 0.02, cubic_Nm_rad3, angle_rad, torque_Nm),
                   Role::test);
  const std::vector<std::string> warnings = evaluate_model(file, later).warnings;
  const std::vector<ScoredRun> runs = scored_runs(make_estimator(file), later);
  EXPECT_EQ(evaluate_model(file, later, runs).warnings, warnings);
  return warnings;
}

TEST(EvaluateModel, NamesAZeroThatChanged) {
  constexpr double kCubic = 1e5;
  EXPECT_THAT(zero_warnings(kCubic, 0.0, 0.0), testing::IsEmpty());
  const auto of_angle = zero_warnings(kCubic, 0.01, 0.0);
  ASSERT_EQ(of_angle.size(), 1U);
  EXPECT_THAT(of_angle[0], testing::HasSubstr("too low throughout"));
  EXPECT_THAT(of_angle[0], testing::HasSubstr("was the zero of an encoder changed"));
  EXPECT_THAT(of_angle[0], testing::HasSubstr("-0.00999 rad added to joint_angle_rad explain it "
                                              "better than another zero of torque_Nm"));
  EXPECT_THAT(of_angle[0], testing::HasSubstr("{channel: gear_angle_rad, first: 0.5s}"));
  const auto of_torque = zero_warnings(kCubic, 0.0, -6.0);
  ASSERT_EQ(of_torque.size(), 1U);
  EXPECT_THAT(of_torque[0], testing::HasSubstr("6 Nm too high throughout"));
  EXPECT_THAT(of_torque[0], testing::HasSubstr("a constant load on its sensor?"));
  EXPECT_THAT(of_torque[0], testing::Not(testing::HasSubstr("encoder")));
  const auto of_linear_spring = zero_warnings(0.0, 0.01, 0.0);
  ASSERT_EQ(of_linear_spring.size(), 1U);
  EXPECT_THAT(of_linear_spring[0], testing::HasSubstr("was the zero of an encoder changed"));
  EXPECT_THAT(of_linear_spring[0], testing::HasSubstr("The data do not distinguish this"));
}

TEST(EvaluateModel, DoesNotCallAnotherStiffnessAnOffset) {
  const ModelFile file = trained(test::bench_dataset(), "linear").file;
  Dataset stiffer;
  test::add_record(stiffer, test::bench_recording("stiffer", {.stiffness_Nm_rad = 800.0}),
                   Role::test);
  for (const std::string& warning : evaluate_model(file, stiffer).warnings)
    EXPECT_THAT(warning, testing::Not(testing::HasSubstr("throughout")));
}

TEST(EvaluateModel, NamesNoFactorOfASpeedThatIsNearOne) {
  const Dataset dataset = test::bench_dataset();
  ModelFile file = trained(dataset, "linear_coulomb").file;
  FeatureRanges& ranges = file.settings.ranges;
  ranges.highest[1] *= 0.97;
  ranges.lowest[1] = -0.1 * ranges.highest[1];  // as if it had moved fast to one side only
  const std::vector<std::string> warnings = evaluate_model(file, dataset).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_THAT(warnings[0], testing::StartsWith("lowpass(spring_deflection_rate_rad_s"));
  EXPECT_THAT(warnings[0], testing::HasSubstr("covers this range"));
}

TEST(TrainModel, IsTheSameForTheSameSeedAndKnowsWhereItCameFrom) {
  const Dataset dataset = test::bench_dataset();
  for (const char* family : {"linear", "linear_coulomb", "polynomial", "dgmm"})
    EXPECT_EQ(model_bytes(trained(dataset, family).file),
              model_bytes(trained(dataset, family).file))
        << family;
  const TrainedModel model = trained(dataset, "dgmm");
  EXPECT_EQ(model.file.card.fitted_as, "dgmm");
  EXPECT_EQ(model.file.card.training_files.size(), 2U);
  EXPECT_EQ(model.file.settings.target, "torque_Nm");
}

TEST(TrainModel, StopsWhenAskedTo) {
  const Dataset dataset = test::bench_dataset();
  const ModelChoice choice{.family = "dgmm", .features = resolve_inputs(dataset, {})};
  EXPECT_THROW(
      (void)train_model(dataset, choice, 1, [](double, std::string_view) { return false; }),
      Cancelled);
}

}  // namespace
}  // namespace torsio
