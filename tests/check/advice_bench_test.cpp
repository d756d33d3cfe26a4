// On simulated benches the first proposal of the advice lowers the error on an independent test more
// than the same recordings made once more.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ostream>
#include <string>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/pulled_bench.hpp"
#include "torsio/check/advice.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"
#include "torsio/report/check.hpp"

namespace torsio {
namespace {

struct Case {
  const char* name;
  const char* actuator;
  std::vector<test::TorqueTriangle> recorded;
  double largest_Nm;  ///< of the intended use
  double lowest_Hz;
  double highest_Hz;
  std::vector<std::string> inputs = {};
};
std::ostream& operator<<(std::ostream& out, const Case& each) { return out << each.name; }

constexpr double kRecorded_s = 30.0;

Dataset recorded(const Case& each, std::uint64_t seed) {
  Dataset dataset;
  for (const test::TorqueTriangle& wave : each.recorded)
    test::add_record(dataset,
                     test::pulled_triangles(each.actuator, wave, kRecorded_s,
                                            100 * seed + dataset.records.size()),
                     Role::train);
  return dataset;
}

double test_rmse(Dataset dataset, const Recording& held_out, const FeatureSpec& features,
                 const char* family) {
  test::add_record(dataset, held_out, Role::test);
  const TrainedModel trained = train_model(dataset, {.family = family, .features = features}, 1);
  double rmse = 0.0;
  for (const ResultRow& row : evaluate_model(trained.file, dataset).rows)
    if (row.split == Role::test && !row.recording) rmse = row.score.metrics.rmse;
  return rmse;
}

class AdviceOnABench : public testing::TestWithParam<Case> {};

TEST_P(AdviceOnABench, FirstProposalLowersTheErrorMoreThanTheSameAgain) {
  const Case& each = GetParam();
  for (const std::uint64_t seed : {1}) {
    const Dataset dataset = recorded(each, seed);
    const FeatureSpec features = resolve_inputs(dataset, each.inputs);
    // The range of the input at the largest torque, as a user would take it from a data sheet.
    Dataset use;
    test::add_record(use,
                     test::pulled_at_random(each.actuator, each.largest_Nm, each.lowest_Hz,
                                            each.highest_Hz, 20.0, 900),
                     Role::train);
    double reach = 0.0;
    for (const double x : first_feature(use.records[0].recording, features))
      if (std::isfinite(x)) reach = std::max(reach, std::abs(x));
    const Recording held_out = test::pulled_at_random(each.actuator, each.largest_Nm,
                                                      each.lowest_Hz, each.highest_Hz, 100.0, 901);
    const std::vector<WantedRange> wanted{{"input", -reach, reach},
                                          {"frequency", each.lowest_Hz, each.highest_Hz}};
    const Advice advice = advise(dataset, features, wanted);
    if (std::getenv("VERBOSE")) std::printf("%s\n", advice_text(advice).c_str());
    ASSERT_FALSE(advice.proposals.empty());
    const Proposal& first = advice.proposals.front();
    ASSERT_TRUE(first.motion) << first.recording;
    // Torque of the proposed motion, by the slope of the recordings.
    const double stiffness = each.largest_Nm / reach;
    const test::TorqueTriangle wave{.amplitude_Nm = stiffness * first.motion->amplitude,
                                    .frequency_Hz = first.motion->frequency_Hz,
                                    .centre_Nm = stiffness * first.motion->centre};
    Dataset with_proposed = dataset;
    test::add_record(with_proposed,
                     test::pulled_triangles(each.actuator, wave, first.duration_s, 500 + seed),
                     Role::train);
    // The same duration of what is there, in equal parts.
    Dataset with_same = dataset;
    for (std::size_t i = 0; i < each.recorded.size(); ++i)
      test::add_record(
          with_same,
          test::pulled_triangles(each.actuator, each.recorded[i],
                                 first.duration_s / static_cast<double>(each.recorded.size()),
                                 700 + 10 * seed + i),
          Role::train);
    for (const char* family : {"maxwell_slip", "grey_box"}) {
      const double before = test_rmse(dataset, held_out, features, family);
      const double proposed = test_rmse(with_proposed, held_out, features, family);
      const double same = test_rmse(with_same, held_out, features, family);
      std::printf(
          "%-24s seed %d %-13s before %.4f proposed %.4f same %.4f | exp %.2f -> %.0f%% | %s\n",
          each.name, static_cast<int>(seed), family, before, proposed, same, advice.wanted_rmse,
          100 * first.assumed_reduction, first.recording.c_str());
      EXPECT_LT(proposed, same) << family << " seed " << seed << ": " << first.recording;
    }
  }
}

const Case kCases[] = {
    {"dfki50_small", "dfki-50", {{10, 0.1}, {10, 0.5}}, 50, 0.05, 1.0},
    {"dfki50_slow", "dfki-50", {{50, 0.1}, {25, 0.1}}, 50, 0.05, 2.0},
    {"dfki50_one", "dfki-50", {{50, 0.1}}, 50, 0.05, 1.0},
    {"dfki120bw_small", "dfki-120:bouc-wen", {{30, 0.2}, {15, 0.2}}, 120, 0.05, 1.0},
    {"dfki28lugre_slow", "dfki-28:lugre", {{28, 0.1}, {14, 0.1}}, 28, 0.05, 2.0},
    {"dfki28lugre_large", "dfki-28:lugre", {{28, 0.1}, {28, 0.5}}, 28, 0.05, 1.0},
    {"elastomer_slow", "elastomer", {{5, 0.1}, {2.5, 0.1}}, 5, 0.05, 3.0},
    {"elastomer_fast", "elastomer", {{5, 2.0}, {2.5, 2.0}}, 5, 0.03, 3.0},
    {"elastomer_small", "elastomer", {{1.2, 0.2}, {1.2, 1.0}}, 5, 0.1, 2.0},
    {"elastomer_grid", "elastomer", {{4, 0.1}, {4, 1.0}, {2, 0.1}, {2, 1.0}}, 5, 0.05, 3.0},
};

INSTANTIATE_TEST_SUITE_P(Benches, AdviceOnABench, testing::ValuesIn(kCases),
                         [](const auto& run) { return std::string(run.param.name); });

}  // namespace
}  // namespace torsio
