#include "torsio/evaluate/estimate_recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "evaluate/trained.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "support/temporary_folder.hpp"
#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/report/estimates.hpp"

namespace torsio {
namespace {

using test::trained;
using testing::HasSubstr;

/// A recording without its target; the deflection jumps out of every range in the second half, and
/// one sample of the gear angle is missing.
Recording without_torque(const Recording& measured) {
  Recording recording("log", measured.sample_rate_Hz(), 2.5);
  for (Channel channel : measured.channels()) {
    if (channel.name == "torque_Nm") continue;
    if (channel.name == "gear_angle_rad") {
      for (std::size_t n = channel.values.size() / 2; n < channel.values.size(); ++n)
        channel.values[n] += 3.0;
      channel.values[700] = std::numeric_limits<double>::quiet_NaN();
    }
    recording.add(std::move(channel));
  }
  return recording;
}

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

TEST(EstimateRecording, EqualsThePredictionAndNeedsNoTarget) {
  const Dataset dataset = test::bench_dataset();
  const ModelFile file = trained(dataset, "linear_coulomb").file;
  const Recording& measured = dataset.records.back().recording;
  Recording log("log", measured.sample_rate_Hz());
  for (const Channel& channel : measured.channels())
    if (channel.name != "torque_Nm") log.add(channel);
  const EstimatedRecording estimated = estimate_recording(make_estimator(file), log);
  const Prediction predicted = predict(make_estimator(file), measured);
  const auto& value = estimated.channels.channel("estimated_torque_Nm").values;
  const auto& std_dev = estimated.channels.channel("torque_std_dev_Nm").values;
  ASSERT_EQ(value.size(), predicted.estimates.size());
  for (std::size_t n = 0; n < value.size(); ++n) {
    ASSERT_EQ(value[n], predicted.estimates[n].value) << n;
    ASSERT_EQ(std::isnan(std_dev[n]), std::isnan(predicted.estimates[n].std_dev)) << n;
    ASSERT_EQ(estimated.faults[n], predicted.estimates[n].fault) << n;
  }
}

TEST(EstimateRecording, ReportsEachFaultOverTime) {
  const Dataset dataset = test::bench_dataset();
  const ModelFile file = trained(dataset, "linear_coulomb").file;
  const Recording log = without_torque(dataset.records.back().recording);
  const EstimatedRecording estimated = estimate_recording(make_estimator(file), log);
  EXPECT_EQ(estimated.faults[0], Fault::warming_up);
  EXPECT_EQ(estimated.faults[699], Fault::none);
  EXPECT_EQ(estimated.faults[700], Fault::input_not_finite);
  EXPECT_EQ(estimated.faults.back(), Fault::outside_training_range);
  const EstimateSummary summary = summary_of(estimated, "torque_Nm");
  EXPECT_EQ(summary.samples, log.size());
  ASSERT_FALSE(summary.faults.empty());
  EXPECT_EQ(summary.faults.front().fault, Fault::none);
  std::size_t sum = 0;
  for (const auto& each : summary.faults) sum += each.samples;
  EXPECT_EQ(sum, log.size());
  EXPECT_LT(summary.highest, 100.0) << "3 rad are not among the samples without a fault";
  EXPECT_GT(summary.largest_std_dev, 0.0);
  EXPECT_LE(summary.usable_share(), 0.5);
  const std::string text = estimates_text({summary}, file.settings);
  EXPECT_THAT(text, HasSubstr("outside training range %"));
  EXPECT_THAT(text, HasSubstr("WARNING: "));
  EXPECT_THAT(estimates_json({summary}, file.settings), HasSubstr("\"input_not_finite\": 1"));
}

TEST(EstimateRecording, ReportsAMissingZeroInsteadOfGuessingIt) {
  const Dataset dataset = test::bench_dataset();
  ModelFile file = trained(dataset, "linear").file;
  file.settings.zeroed_channels = {"joint_angle_rad"};
  Recording log = dataset.records.back().recording;
  EXPECT_EQ(estimate_recording(make_estimator(file), log).faults.back(), Fault::zero_not_set);
  log.zeros = {{.channel = "joint_angle_rad", .first_s = 0.1, .mid_range = false}};
  EXPECT_EQ(estimate_recording(make_estimator(file), log).faults.back(), Fault::none);
}

TEST(EstimateRecording, WritesInputsEstimateBarAndFaultByName) {
  const TemporaryFolder folder;
  const Dataset dataset = test::bench_dataset();
  const Recording log = without_torque(dataset.records.back().recording);
  const ModelFile linear = trained(dataset, "linear_coulomb").file;
  const EstimatedRecording estimated = estimate_recording(make_estimator(linear), log);
  write_estimates({estimated, estimated}, folder.path("out.csv"));
  const std::vector<std::string> lines = lines_of(folder.path("out.csv"));
  ASSERT_EQ(lines.size(), 1 + 2 * log.size());
  EXPECT_EQ(lines[0],
            "t_s,gear_angle_rad,joint_angle_rad,estimated_torque_Nm,torque_std_dev_Nm,fault,"
            "recording");
  EXPECT_EQ(lines[1].substr(0, 4), "2.5,");
  EXPECT_THAT(lines[701], testing::MatchesRegex("3.2,nan,.*,nan,input_not_finite,log"));
  EXPECT_THAT(lines[700], testing::EndsWith(",none,log"));
  EXPECT_THAT(lines.back(), testing::EndsWith(",outside_training_range,log"));
  // The novelty of a model that has one.
  const ModelFile mixture = trained(dataset, "dgmm").file;
  write_estimates({estimate_recording(make_estimator(mixture), log)}, folder.path("novel.csv"));
  EXPECT_THAT(lines_of(folder.path("novel.csv"))[0], HasSubstr(",novelty_1,fault,"));
}

TEST(EstimateRecording, StopsWhenAskedTo) {
  const Dataset dataset = test::bench_dataset();
  const ModelFile file = trained(dataset, "linear").file;
  EXPECT_THROW((void)estimate_recording(make_estimator(file), dataset.records.back().recording,
                                        [](double, std::string_view) { return false; }),
               Cancelled);
}

}  // namespace
}  // namespace torsio
