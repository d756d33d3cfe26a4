#include "torsio/fit/train_model.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/fit/common/inputs.hpp"

namespace torsio {
namespace {

TEST(TrainModel, TakesTheZerosOfTheTrainingRecords) {
  Dataset dataset = test::bench_dataset();
  std::swap(dataset.records[0], dataset.records[2]);  // the first is for the test
  for (const std::size_t i : {1, 2})
    dataset.records[i].recording.zeros = {{.channel = "gear_angle_rad", .first_s = 0.1}};
  const ModelChoice choice{.family = "linear", .features = resolve_inputs(dataset, {})};
  const TrainedModel trained = train_model(dataset, choice, 1);
  EXPECT_EQ(trained.file.card.zeros, dataset.records[1].recording.zeros);
  EXPECT_EQ(trained.file.settings.zeroed_channels, std::vector<std::string>{"gear_angle_rad"});

  dataset.records[2].recording.zeros[0].channel = "joint_angle_rad";
  const std::string message = test::error_message([&] { (void)train_model(dataset, choice, 1); });
  EXPECT_NE(message.find("first: zero"), std::string::npos) << message;
  dataset.records[2].recording.zeros.clear();
  EXPECT_THROW((void)train_model(dataset, choice, 1), Error);
}

TEST(TrainModel, RefusesAnInverseWhoseTargetIsOffByUnknownZeros) {
  Dataset dataset = test::bench_dataset();
  dataset.target = "spring_deflection_rad";
  for (DatasetRecord& record : dataset.records) {
    std::vector<double> deflection_rad = record.recording.channel("gear_angle_rad").values;
    const std::vector<double>& joint_rad = record.recording.channel("joint_angle_rad").values;
    for (std::size_t i = 0; i < deflection_rad.size(); ++i) deflection_rad[i] -= joint_rad[i];
    record.recording.add({.name = "spring_deflection_rad", .values = std::move(deflection_rad)});
    record.recording.zeros = {{.channel = "gear_angle_rad", .first_s = 0.1}};
  }
  const auto refusal = [&](const std::vector<std::string>& inputs) {
    const ModelChoice choice{.family = "linear", .features = resolve_inputs(dataset, inputs)};
    return test::error_message([&] { (void)train_model(dataset, choice, 1); });
  };
  EXPECT_NE(refusal({"torque_Nm"}).find("a zero: rule for gear_angle_rad"), std::string::npos);
  EXPECT_EQ(refusal({"lowpass(joint_angle_rad, 10Hz)"}), "") << "no inverse";
}

}  // namespace
}  // namespace torsio
