#include "torsio/fit/common/inputs.hpp"

#include <gtest/gtest.h>

#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {
namespace {

using test::bench_dataset;

TEST(ResolveInputs, DerivesDeflectionItsRateAndTheJointSpeed) {
  const FeatureSpec spec = resolve_inputs(bench_dataset(), {});
  ASSERT_EQ(spec.inputs.size(), 3U);
  EXPECT_EQ(spec.inputs.front(), "spring_deflection_rad");
  const FeaturePipeline pipeline(spec, 1000.0);
  EXPECT_EQ(pipeline.raw_inputs(), (std::vector<std::string>{"gear_angle_rad", "joint_angle_rad"}));
}

TEST(ResolveInputs, TakesARecordedDeflectionAsItIs) {
  Dataset dataset;
  Recording recording("r", 1000.0);
  recording.add({"spring_deflection_rad", std::vector<double>(10, 0.0)});
  recording.add({"torque_Nm", std::vector<double>(10, 0.0)});
  test::add_record(dataset, std::move(recording), Role::train);
  const FeatureSpec spec = resolve_inputs(dataset, {});
  ASSERT_EQ(spec.inputs.size(), 2U);  // no joint speed without a joint angle
  EXPECT_EQ(FeaturePipeline(spec, 1000.0).raw_inputs(),
            std::vector<std::string>{"spring_deflection_rad"});
}

TEST(ResolveInputs, PrefersTheManifestsFirstInputSet) {
  Dataset dataset = bench_dataset();
  dataset.input_sets = {{"plain", {"gear_angle_rad"}}, {"other", {"joint_angle_rad"}}};
  EXPECT_EQ(resolve_inputs(dataset, {}).inputs, std::vector<std::string>{"gear_angle_rad"});
}

TEST(ResolveInputs, ListsTheChannelsWhenOneIsMissing) {
  const std::string message =
      test::error_message([] { (void)resolve_inputs(bench_dataset(), {"motor_current_A"}); });
  EXPECT_NE(message.find("motor_current_A"), std::string::npos) << message;
  EXPECT_NE(message.find("gear_angle_rad, joint_angle_rad, torque_Nm"), std::string::npos)
      << message;
}

TEST(ResolveInputs, RefusesTheTargetAsAnInput) {
  EXPECT_THROW((void)resolve_inputs(bench_dataset(), {"rate(torque_Nm)"}), UsageError);
}

TEST(ResolveInputs, RefusesTwoMeaningsOfOneName) {
  Dataset dataset = bench_dataset();
  dataset.records[0].recording.definitions = {{"twist_rad", "gear_angle_rad - joint_angle_rad"}};
  dataset.records[2].recording.definitions = {{"twist_rad", "joint_angle_rad - gear_angle_rad"}};
  const std::string message =
      test::error_message([&] { (void)resolve_inputs(dataset, {"twist_rad"}); });
  EXPECT_NE(message.find("held out: twist_rad"), std::string::npos) << message;
  dataset.records[2].recording.definitions = dataset.records[0].recording.definitions;
  EXPECT_EQ(resolve_inputs(dataset, {"twist_rad"}).definitions.size(), 1U);
}

TEST(FindLeak, FindsDeclaredAndComputedOnes) {
  Dataset dataset = bench_dataset();
  const FeatureSpec spec = resolve_inputs(dataset, {});
  EXPECT_EQ(find_leak(dataset, spec), "");
  dataset.target_computed_from = {"gear_angle_rad"};
  EXPECT_EQ(find_leak(dataset, spec), "gear_angle_rad");
  EXPECT_THROW((void)refuse_leak(dataset, spec, false), UsageError);
  EXPECT_EQ(refuse_leak(dataset, spec, true), "gear_angle_rad");
}

TEST(FindLeak, FindsADifferenceWhoseSourcesAreBothInputs) {
  Dataset dataset = bench_dataset();
  dataset.target = "spring_deflection_rad";
  for (DatasetRecord& record : dataset.records)
    add_derived(record.recording, {{"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"}});
  const auto leak = [&](const std::vector<std::string>& inputs) {
    return find_leak(dataset, resolve_inputs(dataset, inputs));
  };
  EXPECT_EQ(leak({"torque_Nm", "rate(joint_angle_rad)"}), "");
  EXPECT_EQ(leak({"torque_Nm", "rate(gear_angle_rad - joint_angle_rad)"}), "");
  EXPECT_EQ(leak({"gear_angle_rad", "torque_Nm", "joint_angle_rad"}),
            "gear_angle_rad, torque_Nm, joint_angle_rad");
}

}  // namespace
}  // namespace torsio
