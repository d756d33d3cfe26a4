#include "torsio/fit/common/training_data.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "fit/common/guards.hpp"
#include "fit/common/model_run.hpp"
#include "fit/common/usable_table.hpp"
#include "model/linear/linear.hpp"
#include "support/bench_dataset.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

/// 10 samples at 100 Hz: deflection n^2, torque 10 n.
Recording ramp() {
  Recording recording("ramp", 100.0);
  Channel deflection{.name = "spring_deflection_rad", .values = {}};
  Channel torque{.name = "torque_Nm", .values = {}};
  for (int n = 0; n < 10; ++n) {
    deflection.values.push_back(n * n);
    torque.values.push_back(10.0 * n);
  }
  recording.add(deflection);
  recording.add(torque);
  return recording;
}

Dataset dataset_of(Recording recording, std::vector<Segment> segments) {
  Dataset dataset;
  dataset.records.push_back({std::move(recording), std::move(segments)});
  return dataset;
}

const FeatureSpec kSpec{.inputs = {"spring_deflection_rad", "rate(spring_deflection_rad)"},
                        .definitions = {}};

TEST(TrainingData, HasFeaturesTargetsAndWhatTheInputsAre) {
  const TrainingData data = training_data(dataset_of(ramp(), whole_record(10, Role::train)), kSpec);
  ASSERT_EQ(data.input_count(), 2U);
  EXPECT_EQ(data.inputs[1].expression, "rate(spring_deflection_rad)");
  EXPECT_FALSE(data.inputs[0].is_rate);
  EXPECT_TRUE(data.inputs[1].is_rate);
  EXPECT_EQ(data.sample_rate_Hz, 100.0);
  EXPECT_EQ(data.target, "torque_Nm");
  ASSERT_EQ(data.sequences.size(), 1U);
  const Sequence& sequence = data.sequences[0];
  EXPECT_EQ(sequence.recording, "ramp");
  EXPECT_EQ(sequence.features(4, 0), 16.0);
  EXPECT_DOUBLE_EQ(sequence.features(4, 1), 700.0);
  EXPECT_EQ(sequence.target[4], 40.0);
}

/// The bench with absurd values of the gear angle and the torque in its first record.
Dataset with_absurd_values() {
  Dataset dataset = test::bench_dataset();
  const Recording sound = dataset.records[0].recording;
  Recording spoiled("spoiled", sound.sample_rate_Hz());
  spoiled.source.file = "spoiled.csv";
  for (Channel channel : sound.channels()) {
    if (channel.name == "gear_angle_rad") channel.values[1200] = 1e12;
    if (channel.name == "torque_Nm") channel.values[2000] = -1e12;
    spoiled.add(std::move(channel));
  }
  dataset.records[0].recording = std::move(spoiled);
  return dataset;
}

TEST(TrainingData, TakesAbsurdValuesAsNotMeasured) {
  const Dataset sound = test::bench_dataset();
  const Dataset spoiled = with_absurd_values();
  const FeatureSpec spec = resolve_inputs(sound, {});
  const TrainingData expected = training_data(sound, spec);
  const TrainingData data = training_data(spoiled, spec);
  EXPECT_TRUE(expected.left_out.empty());
  ASSERT_EQ(data.left_out.size(), 2U);
  EXPECT_EQ(data.left_out[0].text(), "spoiled.csv, sample 2000 (t = 2 s): torque_Nm = -1e+12");
  EXPECT_EQ(data.left_out[1].text(),
            "spoiled.csv, sample 1200 (t = 1.2 s): gear_angle_rad = 1e+12");
  EXPECT_EQ(data.usable_samples(), expected.usable_samples() - 2);
  EXPECT_EQ(data.sequences[0].use[1200], 0);
  EXPECT_EQ(data.sequences[0].use[2000], 0);
  EXPECT_TRUE(std::isnan(data.sequences[0].target[2000]));
  // The guards are those of the sound records: the filters have not seen 1e12.
  const FeatureRanges ranges = feature_ranges(data);
  const FeatureRanges right = feature_ranges(expected);
  for (std::size_t j = 0; j < data.input_count(); ++j) {
    const double width = right.highest[j] - right.lowest[j];
    EXPECT_NEAR(ranges.lowest[j], right.lowest[j], 0.02 * width);
    EXPECT_NEAR(ranges.highest[j], right.highest[j], 0.02 * width);
  }
}

TEST(TrainModel, AnAbsurdValueNeitherWidensTheGuardNorSpoilsTheFit) {
  const Dataset sound = test::bench_dataset();
  const ModelChoice choice{.family = "linear_coulomb", .features = resolve_inputs(sound, {})};
  const TrainedModel expected = train_model(sound, choice, 1);
  const TrainedModel model = train_model(with_absurd_values(), choice, 1);
  EXPECT_LT(model.file.settings.ranges.highest[0], 0.1);
  EXPECT_NEAR(model.file.settings.fallback.slope[0], expected.file.settings.fallback.slope[0], 1.0);
  ASSERT_EQ(model.notes.size(), expected.notes.size() + 2);
  EXPECT_NE(model.notes[0].find("spoiled.csv, sample 2000 (t = 2 s): torque_Nm"),
            std::string::npos);
}

TEST(TrainingData, UsesOnlyItsRoleButFiltersRunThrough) {
  const Dataset dataset = dataset_of(ramp(), {{2, 4, Role::train}, {5, 7, Role::test}});
  const TrainingData test = training_data(dataset, kSpec, Role::test);
  EXPECT_EQ(test.sequences[0].use, (std::vector<std::uint8_t>{0, 0, 0, 0, 0, 1, 1, 0, 0, 0}));
  const Table table = usable_table(test);
  EXPECT_EQ(table.target, (std::vector{50.0, 60.0}));
  EXPECT_EQ(table.features(0, 0), 25.0);
  EXPECT_DOUBLE_EQ(table.features(0, 1), 900.0)
      << "the difference to the sample before the segment";
}

TEST(TrainingData, LeavesOutUnsettledUnmeasuredAndHeldSamples) {
  Recording recording("held", 100.0);
  recording.add(ramp().channel("spring_deflection_rad"));
  Channel torque = ramp().channel("torque_Nm");
  torque.values[6] = kNotMeasured;
  torque.fresh = {1, 1, 1, 0, 1, 1, 1, 1, 1, 1};
  recording.add(torque);
  const TrainingData data =
      training_data(dataset_of(recording, whole_record(10, Role::train)), kSpec);
  EXPECT_EQ(data.sequences[0].use[0], 0) << "the difference has no sample before it";
  EXPECT_EQ(data.sequences[0].use[3], 0) << "held";
  EXPECT_EQ(data.sequences[0].use[6], 0) << "not measured";
  EXPECT_EQ(data.sequences[0].use[9], 1);
}

TEST(TrainingData, EachRecordStartsWithFreshFilters) {
  Dataset dataset = dataset_of(ramp(), whole_record(10, Role::train));
  dataset.records.push_back(dataset.records[0]);
  const TrainingData data = training_data(dataset, kSpec);
  ASSERT_EQ(data.sequences.size(), 2U);
  EXPECT_EQ(data.sequences[0].features, data.sequences[1].features);
  EXPECT_EQ(data.sequences[0].use, data.sequences[1].use);
}

std::string refusal(const Dataset& dataset, const FeatureSpec& spec, Role role = Role::train) {
  try {
    (void)training_data(dataset, spec, role);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(TrainingData, NamesRecordChannelAndSampleOfAnInputThatIsNotFinite) {
  Recording recording("gap", 100.0);
  Channel deflection = ramp().channel("spring_deflection_rad");
  deflection.values[7] = kNotMeasured;
  recording.add(deflection);
  recording.add(ramp().channel("torque_Nm"));
  const std::string message = refusal(dataset_of(recording, whole_record(10, Role::train)), kSpec);
  for (const char* part :
       {"gap: spring_deflection_rad: expected a finite number",
        "t = 0.07 s (sample 7), the first of 1", "hold: [spring_deflection_rad]"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(TrainingData, LeavesOutSamplesWhoseFeatureIsNotFinite) {
  const Dataset dataset = dataset_of(ramp(), whole_record(10, Role::train));
  const FeatureSpec spec{.inputs = {"spring_deflection_rad / (spring_deflection_rad - 16)"},
                         .definitions = {}};
  const TrainingData data = training_data(dataset, spec);
  EXPECT_EQ(data.sequences[0].use, (std::vector<std::uint8_t>{1, 1, 1, 1, 0, 1, 1, 1, 1, 1}));
  EXPECT_FALSE(data.sequences[0].has_features(4));
  AnyModel model = Linear({.coefficients = {.values = Matrix(1, 2, 1.0)}});
  const std::vector<Estimate> estimate = run(model, data.sequences[0]);
  EXPECT_EQ(estimate[4].fault, Fault::input_not_finite);
  EXPECT_EQ(estimate[5].fault, Fault::none);
}

TEST(TrainingData, NamesTheExpressionThatIsNeverFinite) {
  const FeatureSpec spec{.inputs = {"1 / (spring_deflection_rad * 0)"}, .definitions = {}};
  const std::string message = refusal(dataset_of(ramp(), whole_record(10, Role::train)), spec);
  EXPECT_NE(message.find("ramp: input 1 / (spring_deflection_rad * 0), sample 0"),
            std::string::npos)
      << message;
}

TEST(TrainingData, RefusesMissingInputsAndRolesWithoutSamples) {
  const Dataset dataset = dataset_of(ramp(), whole_record(10, Role::train));
  const FeatureSpec missing{.inputs = {"joint_speed_rad_s"}, .definitions = {}};
  EXPECT_NE(refusal(dataset, missing).find("joint_speed_rad_s"), std::string::npos);
  EXPECT_NE(refusal(dataset, kSpec, Role::validation).find("nothing to use with role validation"),
            std::string::npos);
}

}  // namespace
}  // namespace torsio
