// What `fit` refuses, `check` reports as FAIL: both use the same rules.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include "check/check_support.hpp"
#include "support/bench_dataset.hpp"
#include "support/error_message.hpp"
#include "torsio/check/check.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

using test::bench_recording;

/// A recording of the bench with changed channels.
Recording changed(const std::function<void(Channel&)>& change, std::size_t samples = 4000) {
  return test::changed(bench_recording("changed", {.samples = samples}), change);
}

Recording with_torque(const std::function<void(Channel&)>& change) {
  return test::with_torque(bench_recording("changed"), change);
}

Recording stale(std::size_t new_samples) {
  return with_torque([&](Channel& torque) {
    torque.fresh.assign(torque.values.size(), 0);
    for (std::size_t k = 0; k < new_samples; ++k) torque.fresh[1000 + 20 * k] = 1;
  });
}

Recording scaled_angles(double factor) {
  return changed([&](Channel& channel) {
    if (channel.name == "torque_Nm") return;
    for (double& value : channel.values) value *= factor;
  });
}

struct Case {
  const char* name;
  std::function<Dataset()> dataset;
  std::vector<std::string> inputs = {};
  const char* message;  ///< part of the finding and of the refusal
};
std::ostream& operator<<(std::ostream& out, const Case& each) { return out << each.name; }

Dataset one(Recording recording, Role role = Role::train) {
  Dataset dataset;
  test::add_record(dataset, std::move(recording), role);
  return dataset;
}

/// A sound recording for training and another one.
Dataset sound_and(Recording recording, Role role) {
  Dataset dataset = one(bench_recording("sound"));
  test::add_record(dataset, std::move(recording), role);
  return dataset;
}

Dataset zeroed_differently() {
  Dataset dataset = sound_and(bench_recording("zeroed"), Role::train);
  dataset.records[1].recording.zeros = {{.channel = "joint_angle_rad", .first_s = 0.1}};
  return dataset;
}

const char* const kDeflectionFormula = "gear_angle_rad - joint_angle_rad";

const Case kRefused[] = {
    {"every_sample_stale", [] { return one(stale(0)); }, {}, "nothing to use with role train"},
    {"six_new_samples", [] { return one(stale(6)); }, {}, "too few training samples"},
    {"torque_only_before_the_filters_settle",
     [] {
       return one(with_torque([](Channel& torque) {
         std::fill(torque.values.begin() + 30, torque.values.end(), kNotMeasured);
       }));
     },
     {},
     "nothing to use with role train"},
    {"shorter_than_the_filters",
     [] { return one(bench_recording("short", {.samples = 101})); },
     {},
     "nothing to use with role train"},
    {"a_filter_that_never_settles",
     [] { return one(bench_recording("slow")); },
     {kDeflectionFormula, "lowpass(gear_angle_rad, 0.01Hz)"},
     "nothing to use with role train"},
    {"constant_at_its_new_samples",
     [] {
       return one(with_torque([](Channel& torque) {
         torque.fresh.assign(torque.values.size(), 0);
         for (std::size_t n = 0; n < 3000; n += 8) torque.fresh[n] = 1, torque.values[n] = 1.0;
       }));
     },
     {},
     "expected a target that changes"},
    {"every_input_constant",
     [] { return one(bench_recording("constant")); },
     {"joint_angle_rad - joint_angle_rad"},
     "expected at least one input that changes"},
    {"an_input_that_is_infinite",
     [] { return one(bench_recording("infinite")); },
     {kDeflectionFormula, "1 / (joint_angle_rad - joint_angle_rad)"},
     "no sample is left to learn from"},
    {"an_input_with_squares_that_overflow",
     [] { return one(bench_recording("large")); },
     {kDeflectionFormula, "joint_angle_rad * 1e150"},
     "whose squares can be summed"},
    {"angles_with_squares_that_overflow",
     [] { return one(scaled_angles(1e200)); },
     {},
     "whose squares can be summed"},
    {"a_target_with_squares_that_overflow",
     [] {
       return one(with_torque([](Channel& torque) {
         for (double& value : torque.values) value *= 1e200;
       }));
     },
     {},
     "whose squares can be summed"},
    {"a_target_with_squares_that_vanish",
     [] {
       return one(with_torque([](Channel& torque) {
         for (double& value : torque.values) value *= 1e-250;
       }));
     },
     {},
     "whose square is not 0"},
    {"stale_validation",
     [] { return sound_and(stale(0), Role::validation); },
     {},
     "nothing to use with role validation"},
    {"no_training_recording",
     [] { return one(bench_recording("held out"), Role::test); },
     {},
     "nothing to use with role train"},
    {"zeros_that_differ",
     [] { return zeroed_differently(); },
     {},
     "disagree about which channels are zeroed"},
};

class Refused : public testing::TestWithParam<Case> {};

TEST_P(Refused, ByFitIsAFailOfCheck) {
  const Dataset dataset = GetParam().dataset();
  const FeatureSpec features = resolve_inputs(dataset, GetParam().inputs);
  const std::string refusal = test::error_message(
      [&] { (void)train_model(dataset, {.family = "linear", .features = features}, 1); });
  EXPECT_NE(refusal.find(GetParam().message), std::string::npos) << refusal;
  const std::vector<Finding> findings = test::findings_of(dataset, features);
  const auto failed = std::ranges::find(findings, Verdict::fail, &Finding::verdict);
  ASSERT_NE(failed, findings.end());
  EXPECT_NE(failed->message.find(GetParam().message), std::string::npos) << failed->message;
}

INSTANTIATE_TEST_SUITE_P(CheckTraining, Refused, testing::ValuesIn(kRefused),
                         [](const auto& run) { return std::string(run.param.name); });

std::vector<Finding> training_findings(const Dataset& dataset,
                                       const std::vector<std::string>& inputs = {}) {
  std::vector<Finding> findings = test::findings_of(dataset, resolve_inputs(dataset, inputs));
  std::erase_if(findings, [](const Finding& finding) { return finding.check != "training data"; });
  return findings;
}

TEST(CheckTraining, PassesWhatFitAccepts) {
  const auto findings = training_findings(test::bench_dataset());
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().verdict, Verdict::pass);
}

TEST(CheckTraining, WarnsOfARecordingThatIsNotUsed) {
  const auto findings = training_findings(sound_and(stale(0), Role::train));
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().verdict, Verdict::warn);
  EXPECT_EQ(findings.front().recording, "changed");
}

TEST(CheckTraining, WarnsOfFewUsableSamplesAndOfInputsThatAreNotFinite) {
  for (const std::size_t fresh : {10U, 150U}) {
    const auto few = training_findings(one(stale(fresh)));
    ASSERT_EQ(few.size(), 1U);
    EXPECT_EQ(few.front().verdict, Verdict::warn);
    EXPECT_NE(few.front().message.find("grey_box needs 200"), std::string::npos)
        << few.front().message;
  }
  const auto findings =
      training_findings(one(bench_recording("root")), {kDeflectionFormula, "joint_angle_rad^0.5"});
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_NE(findings.front().message.find("not finite in"), std::string::npos);
}

TEST(CheckTraining, AStaleTestRecordingIsAFindingAndNotAnError) {
  const auto findings = training_findings(sound_and(stale(0), Role::test));
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().verdict, Verdict::fail);
}

}  // namespace
}  // namespace torsio
