#include "evaluate/initial_state.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "model/viscoelastic/viscoelastic.hpp"
#include "support/examples/linear.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::Pointwise;

/// Relaxes within 20 ms and 2 s, at 1 kHz.
AnyModel two_branches() {
  return Viscoelastic(
      {.network = parse_network("parallel(k0=300, maxwell(k1=200, d1=4), maxwell(k2=100, d2=200))"),
       .offset = 1.0,
       .sample_period_s = 1e-3,
       .inputs = 1});
}

struct Measured {
  Matrix features;
  std::vector<double> target;
};

Measured run_from(const std::vector<double>& state, std::size_t samples, double noise) {
  Random random(4);
  AnyModel model = two_branches();
  model.set_state(state);
  Measured run{Matrix(samples, 1), {}};
  for (std::size_t n = 0; n < samples; ++n) {
    run.features(n, 0) = 0.05 * std::sin(0.02 * static_cast<double>(n));
    run.target.push_back(model.step(run.features.row(n)).value + noise * random.normal());
  }
  return run;
}

const std::vector<double> kState{8.0, -3.0};  // slowest first
constexpr double kError = 1e-6;               // error of a correct model

TEST(InitialState, IsTheOneThatTheRunWasStartedFrom) {
  const Measured run = run_from(kState, 200, 0.0);
  AnyModel model = two_branches();
  start_where_measured(model, run.features, run.target, kError);
  EXPECT_THAT(model.state(), Pointwise(DoubleNear(1e-4), kState));
}

TEST(InitialState, IsNearItInNoise) {
  const Measured run = run_from(kState, 200, 0.1);
  AnyModel model = two_branches();
  start_where_measured(model, run.features, run.target, 0.1);
  EXPECT_THAT(model.state(), Pointwise(DoubleNear(0.2), kState));
}

TEST(InitialState, PassesOverSamplesThatWereNotMeasured) {
  Measured run = run_from(kState, 200, 0.0);
  for (std::size_t n = 0; n < run.target.size(); ++n)
    if (n % 3 != 0) run.target[n] = kNotMeasured;
  AnyModel model = two_branches();
  start_where_measured(model, run.features, run.target, kError);
  EXPECT_THAT(model.state(), Pointwise(DoubleNear(1e-4), kState));
}

TEST(InitialState, RemainsAtRestWithoutMeasuredSamples) {
  Measured run = run_from(kState, 20, 0.0);
  for (double& target : run.target) target = kNotMeasured;
  AnyModel model = two_branches();
  model.set_state(kState);
  start_where_measured(model, run.features, run.target, kError);
  EXPECT_THAT(model.state(), ElementsAre(0.0, 0.0));
}

TEST(InitialState, OfAFamilyWithoutIsAReset) {
  AnyModel model = test::example<Linear>();
  EXPECT_TRUE(model.state().empty());
  const Measured run = run_from(kState, 20, 0.0);
  Matrix features(20, model.input_count());
  EXPECT_NO_THROW(start_where_measured(model, features, run.target, kError));
}

}  // namespace
}  // namespace torsio
