// The torque of a known load as the target.
#include <gtest/gtest.h>

#include "check/check_support.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

using test::bench_dataset;
using test::findings_of;
using test::first_of;
using test::text_of;
using test::verdict_of;

constexpr const char* kCheck = "known load";

/// The bench with the torque of two known levers.
Dataset loaded_bench() {
  Dataset dataset = bench_dataset();
  dataset.load_target = {
      .file = "load.yaml",
      .computed_from = {"joint_angle_rad"},
      .half_width_s = 0.02,
      .motion_error_Nm = 0.05,
      .load_error_Nm = 0.1,
      .loads = {{"first", 10.0, 0.2, 0.0, 0.05}, {"second", 15.0, 0.4, 0.0, 0.05}},
      .facts = {{"mass", 0.06}, {"length", 0.08}}};
  return dataset;
}

TEST(CheckKnownLoad, PassesWhereTheLoadIsKnownWell) {
  const auto findings = findings_of(loaded_bench());
  EXPECT_EQ(verdict_of(findings, kCheck), Verdict::pass) << text_of(findings);
  EXPECT_NE(first_of(findings, kCheck).message.find("10 to 15 Nm"), std::string::npos);
}

TEST(CheckKnownLoad, IsSilentWhereTheTorqueWasMeasured) {
  for (const Finding& finding : findings_of(bench_dataset())) EXPECT_NE(finding.check, kCheck);
}

TEST(CheckKnownLoad, FailsWhereTheTorqueHardlyChanges) {
  Dataset dataset = loaded_bench();
  dataset.load_target.motion_error_Nm = 4.0;
  EXPECT_EQ(verdict_of(findings_of(dataset), kCheck), Verdict::fail);
}

TEST(CheckKnownLoad, NamesTheFactWhoseErrorIsLargest) {
  Dataset dataset = loaded_bench();
  dataset.load_target.load_error_Nm = 2.0;
  dataset.load_target.facts = {{"mass", 0.3}, {"length", 1.9}};
  const auto findings = findings_of(dataset);
  EXPECT_EQ(verdict_of(findings, kCheck), Verdict::warn);
  EXPECT_NE(first_of(findings, kCheck).advice.find("length"), std::string::npos);
}

TEST(CheckKnownLoad, WarnsOfOneLoadAndOfFactsWithoutErrors) {
  Dataset dataset = loaded_bench();
  dataset.load_target.loads[1] = dataset.load_target.loads[0];
  EXPECT_EQ(verdict_of(findings_of(dataset), kCheck), Verdict::warn);
  dataset = loaded_bench();
  dataset.load_target.facts.clear();
  EXPECT_NE(first_of(findings_of(dataset), kCheck).message.find("no load_uncertainty"),
            std::string::npos);
}

TEST(CheckKnownLoad, ExpectsNoTorqueAtTheEndsOfARecording) {
  const auto verdict = [](std::size_t first_missing, bool has_load) {
    Dataset dataset = has_load ? loaded_bench() : bench_dataset();
    dataset.records[0].recording =
        test::with_torque(dataset.records[0].recording, [&](Channel& torque) {
          for (std::size_t n = 0; n < 20; ++n) torque.values[first_missing + n] = kNotMeasured;
        });
    return verdict_of(findings_of(dataset), "missing values");
  };
  EXPECT_EQ(verdict(0, true), Verdict::pass);
  EXPECT_EQ(verdict(1000, true), Verdict::warn);
  EXPECT_EQ(verdict(0, false), Verdict::warn);
}

}  // namespace
}  // namespace torsio
