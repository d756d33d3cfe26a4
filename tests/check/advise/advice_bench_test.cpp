// On simulated benches the first proposal of the advice lowers the error on an independent test, or the
// share of it that is outside of the training range, more than the same recordings made once more;
// docs/use/advise.md has cases where it does not.
#include <gtest/gtest.h>

#include <cmath>
#include <ostream>
#include <string>
#include <tuple>
#include <vector>

#include "support/bench_dataset.hpp"
#include "support/pulled_bench.hpp"
#include "torsio/check/advise/advice.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

constexpr double kRecorded_s = 30.0;

struct BenchCase {
  const char* name;
  const char* actuator;
  std::vector<test::TorqueTriangle> recorded;
  double largest_Nm;  ///< torque of the intended use
  double lowest_Hz;
  double highest_Hz;
  /// Whether the recordings lack fast motions only. The error of a model that does not depend on the
  /// rate does not show this; the share of the samples outside of its training range does.
  bool is_too_slow = false;
};
std::ostream& operator<<(std::ostream& out, const BenchCase& each) { return out << each.name; }

const BenchCase kCases[] = {
    {"SlowMotionOnly", "dfki-50", {{50, 0.1}, {25, 0.1}}, 50, 0.05, 2.0, true},
    {"SmallMotionOnly", "dfki-120:bouc-wen", {{30, 0.2}, {15, 0.2}}, 120, 0.05, 1.0},
    {"FastMotionOnly", "elastomer", {{5, 2.0}, {2.5, 2.0}}, 5, 0.03, 3.0},
};

Recording in_use(const BenchCase& each, double duration_s, std::uint64_t seed) {
  return test::pulled_at_random(each.actuator, each.largest_Nm, each.lowest_Hz, each.highest_Hz,
                                duration_s, seed);
}

/// RMSE on an independent test, or the share of its samples outside of the training range.
double shortcoming(const BenchCase& each, Dataset dataset, const Recording& held_out,
                   const FeatureSpec& features) {
  test::add_record(dataset, held_out, Role::test);
  const TrainedModel trained =
      train_model(dataset, {.family = "maxwell_slip", .features = features}, 1);
  for (const ResultRow& row : evaluate_model(trained.file, dataset).rows)
    if (row.split == Role::test && !row.recording)
      return each.is_too_slow ? static_cast<double>(row.score.guarded_samples) /
                                    static_cast<double>(row.score.metrics.samples)
                              : row.score.metrics.rmse;
  return kNotMeasured;
}

class AdviceOnABench : public testing::TestWithParam<std::tuple<BenchCase, std::uint64_t>> {};

TEST_P(AdviceOnABench, FirstProposalHelpsMoreThanTheSameAgain) {
  const auto& [each, seed] = GetParam();
  Dataset dataset;
  for (const test::TorqueTriangle& wave : each.recorded)
    test::add_record(dataset,
                     test::pulled_triangles(each.actuator, wave, kRecorded_s,
                                            100 * seed + dataset.records.size()),
                     Role::train);
  const FeatureSpec features = resolve_inputs(dataset, {});
  // The range of the input in use, as a user would take it from a data sheet.
  double reach = 0.0;
  for (const double x : first_feature(in_use(each, 20.0, 900), features))
    if (std::isfinite(x)) reach = std::max(reach, std::abs(x));
  const Advice advice =
      advise(dataset, features,
             {{"input", -reach, reach}, {"frequency", each.lowest_Hz, each.highest_Hz}});
  ASSERT_FALSE(advice.proposals.empty());
  const Proposal& first = advice.proposals.front();
  ASSERT_TRUE(first.motion) << first.recording;

  const double stiffness = each.largest_Nm / reach;
  Dataset with_proposed = dataset;
  test::add_record(with_proposed,
                   test::pulled_triangles(each.actuator,
                                          {.amplitude_Nm = stiffness * first.motion->amplitude,
                                           .frequency_Hz = first.motion->frequency_Hz,
                                           .centre_Nm = stiffness * first.motion->centre},
                                          first.duration_s, 500 + seed),
                   Role::train);
  Dataset with_same = dataset;
  const double part_s = first.duration_s / static_cast<double>(each.recorded.size());
  for (const test::TorqueTriangle& wave : each.recorded)
    test::add_record(with_same,
                     test::pulled_triangles(each.actuator, wave, part_s,
                                            700 + 10 * seed + with_same.records.size()),
                     Role::train);

  const Recording held_out = in_use(each, 60.0, 900 + seed);
  const double before = shortcoming(each, dataset, held_out, features);
  const double proposed = shortcoming(each, with_proposed, held_out, features);
  const double same = shortcoming(each, with_same, held_out, features);
  EXPECT_LT(proposed, 0.9 * same) << "before " << before << ": " << first.recording;
  EXPECT_LT(proposed, 0.9 * before) << first.recording;
}

INSTANTIATE_TEST_SUITE_P(Benches, AdviceOnABench,
                         testing::Combine(testing::ValuesIn(kCases),
                                          testing::Values(std::uint64_t{1}, std::uint64_t{2})),
                         [](const auto& run) {
                           return std::string(std::get<0>(run.param).name) + "_" +
                                  std::to_string(std::get<1>(run.param));
                         });

}  // namespace
}  // namespace torsio
