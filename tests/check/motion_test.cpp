#include "check/motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "support/bench_dataset.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

/// A sine of 0.02 rad at 0.5 Hz, 10 s, and the same time at rest.
DatasetRecord sine_and_rest(Role role) {
  Recording recording("sine", 1000.0);
  Channel deflection{"spring_deflection_rad", {}};
  for (std::size_t n = 0; n < 20000; ++n)
    deflection.values.push_back(
        n < 10000 ? 0.02 * std::sin(std::numbers::pi * 1e-3 * static_cast<double>(n)) : 0.0);
  recording.add(std::move(deflection));
  return {std::move(recording), {{.begin = 0, .end = 10000, .role = role}}};
}

const FeatureSpec kDeflectionFeature{.inputs = {"spring_deflection_rad"}, .definitions = {}};

TEST(Motion, OfASineIsItsAmplitudeSpeedAndFrequency) {
  DatasetRecord record = sine_and_rest(Role::train);
  const Motion motion = motion_of(record, Role::train, kDeflectionFeature);
  EXPECT_NEAR(motion.amplitude, 0.02, 2e-4);
  EXPECT_NEAR(motion.frequency_Hz, 0.5, 0.01);
  EXPECT_NEAR(motion.rms_speed, 0.02 * std::numbers::pi / std::numbers::sqrt2, 5e-4);
  EXPECT_LT(motion.rest_share, 0.05);
  record.segments = {{.begin = 0, .end = 20000, .role = Role::train}};
  EXPECT_NEAR(motion_of(record, Role::train, kDeflectionFeature).rest_share, 0.5, 0.03);
  EXPECT_EQ(motion_of(record, Role::test, kDeflectionFeature).rms_speed, 0.0) << "no such samples";
}

/// The held-out recordings of a bench with two training recordings whose motion is of another kind.
std::vector<OtherMotion> against_the_bench(const test::BenchOptions& options) {
  Dataset dataset = test::bench_dataset();
  dataset.records.pop_back();
  test::add_record(dataset, test::bench_recording("held out", options), Role::test);
  return other_motions(dataset, resolve_inputs(dataset, {}));
}

TEST(OtherMotions, NameTheQuantitiesThatDiffer) {
  EXPECT_TRUE(against_the_bench({.amplitude_rad = 0.02, .seed = 9}).empty());
  const auto others = against_the_bench({.amplitude_rad = 0.005, .seed = 9});
  ASSERT_EQ(others.size(), 1U);
  EXPECT_EQ(others.front().recording, "held out");
  EXPECT_EQ(others.front().nearest, "second");
  EXPECT_EQ(others.front().text(), "0.2 times the amplitude, 0.2 times the speed");
}

Recording simulated(const std::string& actuator, const std::string& experiment, std::uint64_t seed,
                    double duration_s = 40.0) {
  return simulate(
      {.actuator = actuator, .experiment = experiment, .seed = seed, .duration_s = duration_s});
}

TEST(OtherMotions, AreNoneBetweenRecordingsOfOneKind) {
  for (const char* actuator : {"dfki-28", "dfki-50", "dfki-120", "dfki-300"}) {
    const Dataset dataset = sweep_dataset(actuator, 1);
    const auto others = other_motions(dataset, resolve_inputs(dataset, {}));
    EXPECT_TRUE(others.empty()) << actuator << ": " << others.front().text();
  }
  for (const auto& [actuator, experiment] :
       {std::pair{"elastomer", "triangles"}, std::pair{"elastomer", "random-walk"},
        std::pair{"dfki-50", "random-walk"}, std::pair{"dfki-50", "chirp"}}) {
    Dataset dataset;
    test::add_record(dataset, simulated(actuator, experiment, 1), Role::train);
    test::add_record(dataset, simulated(actuator, experiment, 2), Role::test);
    const auto others = other_motions(dataset, resolve_inputs(dataset, {}));
    EXPECT_TRUE(others.empty()) << actuator << ' ' << experiment << ": " << others.front().text();
  }
}

TEST(OtherMotions, ReportARandomWalkAfterSweeps) {
  Dataset dataset = sweep_dataset("dfki-50", 1);
  dataset.records.pop_back();
  test::add_record(dataset, simulated("dfki-50", "random-walk", 5), Role::test);
  const auto others = other_motions(dataset, resolve_inputs(dataset, {}));
  ASSERT_EQ(others.size(), 1U);
  EXPECT_NE(others.front().text().find("times the frequency"), std::string::npos)
      << others.front().text();
}

}  // namespace
}  // namespace torsio
