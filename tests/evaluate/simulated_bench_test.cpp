// The main job on the simulated benches: how well each family estimates the torque of a sweep that
// it was not trained on.
#include <gtest/gtest.h>

#include <string>

#include "torsio/evaluate/comparison.hpp"
#include "torsio/sim/experiments/experiment.hpp"

namespace torsio {
namespace {

struct Expectation {
  const char* actuator;
  double linear_Nm;  ///< specification 6, whose prototype left the gear's reaction out
                     ///< (docs/simulation/actuators.md)
};

class SimulatedBench : public testing::TestWithParam<Expectation> {};

double test_rmse(const Results& results, const std::string& family) {
  for (const ResultRow& row : results.rows)
    if (row.family == family && row.split == Role::test && !row.recording)
      return row.score.metrics.rmse;
  ADD_FAILURE() << family << " is not in the table";
  return 0.0;
}

TEST_P(SimulatedBench, RanksTheFamiliesAsTheSpecificationExpects) {
  const Dataset dataset = sweep_dataset(GetParam().actuator, 1);
  const auto choices = model_choices(dataset, "linear,linear_coulomb,dgmm,dgmm_paper", {});
  const Results results = compare(dataset, choices, 1, false).results;
  const double linear = test_rmse(results, "linear");
  EXPECT_NEAR(linear, GetParam().linear_Nm, 0.15 * GetParam().linear_Nm);
  EXPECT_LT(test_rmse(results, "linear_coulomb"), 0.9 * linear);
  EXPECT_LT(test_rmse(results, "dgmm"), 0.75 * linear);
  EXPECT_GT(test_rmse(results, "dgmm_paper"), 2.0 * linear);
}

INSTANTIATE_TEST_SUITE_P(Dfki, SimulatedBench,
                         testing::Values(Expectation{"dfki-50", 1.33},
                                         Expectation{"dfki-120", 1.58}),
                         [](const auto& bench) {
                           return std::string(bench.param.actuator).substr(5);
                         });

}  // namespace
}  // namespace torsio
