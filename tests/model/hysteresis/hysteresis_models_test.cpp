#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "support/error_message.hpp"
#include "support/examples/hysteresis.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

/// The first input at each tick of a path through turning points, in steps of at most `step`.
std::vector<double> path_through(const std::vector<double>& turns, double step) {
  std::vector<double> path{turns.front()};
  for (std::size_t i = 1; i < turns.size(); ++i) {
    const double from = turns[i - 1];
    const int count = std::max(1, static_cast<int>(std::ceil(std::abs(turns[i] - from) / step)));
    for (int n = 1; n <= count; ++n) path.push_back(from + (turns[i] - from) * n / count);
  }
  return path;
}

/// Torques along a path at the given rate input, from wherever the model is.
template <class M>
std::vector<double> torques(M& model, const std::vector<double>& path, double rate = 0.0) {
  std::vector<double> values;
  for (const double x : path) values.push_back(model.step(std::vector{x, rate}).value);
  return values;
}

double work(const std::vector<double>& path, const std::vector<double>& torque) {
  double sum = 0.0;
  for (std::size_t n = 1; n < path.size(); ++n)
    sum += 0.5 * (torque[n] + torque[n - 1]) * (path[n] - path[n - 1]);
  return sum;
}

template <class M>
class HysteresisLaws : public testing::Test {
 protected:
  M model_ = test::example<M>();
};
using Models =
    testing::Types<MaxwellSlipModel, PrandtlIshlinskii, ImprovedPrandtlIshlinskii, BoucWenModel,
                   NonlinearBacklash, ImprovedNonlinearBacklash, ExponentialLoading>;
TYPED_TEST_SUITE(HysteresisLaws, Models);

TYPED_TEST(HysteresisLaws, HasAStateAndRunsBackwards) {
  static_assert(HasState<TypeParam>);
  EXPECT_FALSE(this->model_.state().empty());
  for (const double each : this->model_.state()) EXPECT_EQ(each, 0.0);
}

TYPED_TEST(HysteresisLaws, ARunGoesOnFromAStateThatItIsGiven) {
  auto& model = this->model_;
  torques(model, path_through({0.0, 0.05, -0.02}, 1e-3));
  std::vector<double> state(model.state().begin(), model.state().end());
  auto same = model;
  same.set_state(state);
  const auto onward = path_through({-0.02, 0.03, 0.01}, 1e-3);
  EXPECT_EQ(torques(same, onward), torques(model, onward)) << "its own state changes nothing";

  auto fresh = test::example<TypeParam>();
  fresh.set_state(state);
  const auto from_fresh = torques(fresh, onward);
  model.reset();
  torques(model, path_through({0.0, 0.05, -0.02}, 1e-3));
  const auto expected = torques(model, onward);
  for (std::size_t n = 0; n < onward.size(); ++n) ASSERT_NEAR(from_fresh[n], expected[n], 1e-9);
}

TYPED_TEST(HysteresisLaws, AStateOutOfBoundsIsBroughtBackAndNoNumberPassedOver) {
  auto& model = this->model_;
  std::vector<double> state(model.state().size(), std::numeric_limits<double>::quiet_NaN());
  const std::vector<double> before(model.state().begin(), model.state().end());
  model.set_state(state);
  EXPECT_TRUE(std::ranges::equal(model.state(), before));
  state.assign(state.size(), 1e6);
  model.set_state(state);
  torques(model, path_through({0.0, -0.1, 0.1, 0.0}, 1e-3));
  const double once = model.step(std::vector{0.0, 0.0}).value;
  model.reset();
  torques(model, path_through({0.0, -0.1, 0.1, 0.0}, 1e-3));
  EXPECT_NEAR(model.step(std::vector{0.0, 0.0}).value, once, 0.02) << "forgotten after a loop";
}

template <class M>
class EnergyLaws : public testing::Test {};
// Not exponential loading: where a path turns before it has neared the other curve, it can give work.
using Dissipative = testing::Types<MaxwellSlipModel, PrandtlIshlinskii, ImprovedPrandtlIshlinskii,
                                   BoucWenModel, NonlinearBacklash, ImprovedNonlinearBacklash>;
TYPED_TEST_SUITE(EnergyLaws, Dissipative);

TYPED_TEST(EnergyLaws, LosesEnergyOnEveryRepeatedLoop) {
  EXPECT_TRUE(rc::check([] {
    auto model = test::example<TypeParam>();
    // A few turning points, repeated until the loop is periodic.
    const auto corners = *rc::gen::container<std::vector<int>>(4, rc::gen::inRange(-100, 101));
    std::vector<double> turns;
    for (const int each : corners) turns.push_back(1e-3 * each);
    turns.push_back(turns.front());
    const auto path = path_through(turns, 5e-4);
    for (int i = 0; i < 6; ++i) torques(model, path);
    RC_ASSERT(work(path, torques(model, path)) >= -1e-6);
  }));
}

TYPED_TEST(HysteresisLaws, ALoopRunsThroughTwiceIsTheSameLoop) {
  auto& model = this->model_;
  const auto loop = path_through({0.0, 0.08, -0.08, 0.0}, 1e-3);
  for (int i = 0; i < 4; ++i) torques(model, loop);
  const auto first = torques(model, loop);
  const auto second = torques(model, loop);
  for (std::size_t n = 0; n < loop.size(); ++n) ASSERT_NEAR(first[n], second[n], 1e-3);
}

TYPED_TEST(HysteresisLaws, InvertFindsTheInputOfTheStepThatWasTaken) {
  auto& model = this->model_;
  Random random(4);
  double x = 0.0;
  for (int n = 0; n < 400; ++n) {
    x = std::clamp(x + 0.02 * random.normal(), -0.1, 0.1);
    const double rate = random.normal();
    auto before = model;
    const double torque = model.step(std::vector{x, rate}).value;
    const Estimate there = model.invert(torque, std::vector{0.3, rate});
    EXPECT_EQ(there.fault, Fault::none);
    EXPECT_NEAR(there.value, x, 1e-10) << "seed 4, step " << n;
    const Estimate next = before.invert(torque, std::vector{0.3, rate});
    if (n > 0) {
      EXPECT_NEAR(next.value, x, 1e-10) << "seed 4, step " << n;
    }
  }
}

TYPED_TEST(HysteresisLaws, StaysFiniteForIncrementsWithoutMeasure) {
  auto& model = this->model_;
  for (const double x : {0.0, 1e300, -1e300, 1e-300, -1.7e308, 1.7e308, 0.01}) {
    EXPECT_TRUE(std::isfinite(model.step(std::vector{x / 1e4, 1e200}).value)) << x;
    for (const double each : model.state()) EXPECT_TRUE(std::isfinite(each)) << x;
  }
}

// Those whose loops do not depend on the rate: a path is what counts, not its sampling.
template <class M>
class RateIndependence : public HysteresisLaws<M> {};
using Static = testing::Types<MaxwellSlipModel, PrandtlIshlinskii, BoucWenModel, NonlinearBacklash,
                              ExponentialLoading>;
TYPED_TEST_SUITE(RateIndependence, Static);

TYPED_TEST(RateIndependence, TheSamePathSlowerGivesTheSameLoop) {
  auto slow = this->model_;
  const std::vector<double> turns{0.0, 0.07, -0.03, 0.05, -0.09, 0.0};
  const auto coarse = path_through(turns, 1e-3);
  const auto torque = torques(this->model_, coarse);
  for (std::size_t n = 0; n < coarse.size(); ++n) {
    const double from = n == 0 ? coarse[0] : coarse[n - 1];
    double last = 0.0;
    for (int part = 1; part <= 8; ++part)
      last = slow.step(std::vector{from + (coarse[n] - from) * part / 8, 0.0}).value;
    // Backlash holds to curved boundaries at ticks; Bouc-Wen is integrated by steps.
    ASSERT_NEAR(torque[n], last, 5e-3) << n;
  }
}

TYPED_TEST(RateIndependence, ItsHysteresisHearsNoRate) {
  auto other = this->model_;
  const auto path = path_through({0.0, 0.07, -0.03}, 1e-3);
  const auto still = torques(this->model_, path, 0.0);
  const auto fast = torques(other, path, 2.0);
  for (std::size_t n = 0; n < path.size(); ++n) ASSERT_NEAR(fast[n] - still[n], 0.25 * 2.0, 1e-9);
}

TEST(ImprovedModels, LoopsGrowWithTheRate) {
  const auto path = path_through({0.0, 0.08, -0.08, 0.08, -0.08, 0.08}, 1e-3);
  const auto lost = [&](auto model, double rate) { return work(path, torques(model, path, rate)); };
  EXPECT_GT(lost(test::example<ImprovedPrandtlIshlinskii>(), 2.0),
            1.2 * lost(test::example<ImprovedPrandtlIshlinskii>(), 0.0));
  EXPECT_GT(lost(test::example<ImprovedNonlinearBacklash>(), 2.0),
            1.1 * lost(test::example<ImprovedNonlinearBacklash>(), 0.0));
}

TEST(OperatorSums, StopsAndPlaysAreEquivalent) {
  auto stops = test::example<MaxwellSlipModel>();
  auto plays = test::example<PrandtlIshlinskii>();
  Random random(9);
  double x = 0.0;
  for (int n = 0; n < 3000; ++n) {
    x = std::clamp(x + 0.02 * random.normal(), -0.1, 0.1);
    const std::vector features{x, random.normal()};
    EXPECT_NEAR(stops.step(features).value, plays.step(features).value, 1e-11);
  }
}

TEST(PrandtlIshlinskii, AnInnerLoopLeavesNoTraceOnTheOuterOne) {
  auto with = test::example<PrandtlIshlinskii>();
  auto without = with;
  const auto there = path_through({0.0, 0.09, -0.05}, 1e-3);
  torques(with, there);
  torques(without, there);
  // Wiping out: the inner loop closes and no longer has an effect.
  torques(with, path_through({-0.05, 0.01, -0.02, 0.01, -0.05}, 1e-3));
  const auto onward = path_through({-0.05, -0.08, 0.09}, 1e-3);
  const auto remembered = torques(with, onward);
  const auto expected = torques(without, onward);
  for (std::size_t n = 0; n < onward.size(); ++n) ASSERT_NEAR(remembered[n], expected[n], 1e-9);
}

TEST(PrandtlIshlinskii, LoopsBetweenTheSameTurningPointsAreCongruent) {
  const auto loop = path_through({-0.01, 0.02, -0.01}, 5e-4);
  const auto after = [&](const std::vector<double>& history) {
    auto model = test::example<PrandtlIshlinskii>();
    torques(model, path_through(history, 1e-3));
    torques(model, loop);
    return torques(model, loop);
  };
  const auto from_above = after({0.0, 0.1, -0.01});
  const auto from_below = after({0.0, -0.1, -0.01});
  const double between = from_below[0] - from_above[0];
  EXPECT_GT(std::abs(between), 0.5) << "the histories differ";
  for (std::size_t n = 0; n < loop.size(); ++n)
    ASSERT_NEAR(from_below[n] - from_above[n], between, 1e-9);
}

TEST(PrandtlIshlinskii, PlaysOfPositiveWeightWouldGiveWork) {
  PrandtlIshlinskii::Parameters parameters;
  parameters.thresholds = {0.01};
  parameters.coefficients.values = Matrix(1, 4);
  parameters.coefficients.values.values = {0.0, 500.0, 0.0, 100.0};
  PrandtlIshlinskii model(parameters);
  const auto loop = path_through({0.0, 0.08, -0.08, 0.0}, 1e-3);
  torques(model, loop);
  EXPECT_LT(work(loop, torques(model, loop)), -0.2);
}

TEST(ImprovedPrandtlIshlinskii, ItsBentCurveAndTheStraightenedOneAreInverse) {
  const auto model = test::example<ImprovedPrandtlIshlinskii>();
  for (double v = -90.0; v < 90.0; v += 0.37) {
    EXPECT_NEAR(model.straightened(model.bent(v)), v, 1e-11);
    EXPECT_GT(model.bent(v + 0.01), model.bent(v));
  }
}

TEST(BoucWenModel, ReachesItsLargestHysteresisAndNotMore) {
  const auto parameters = test::example<BoucWenModel>().parameters();
  const double largest = std::pow(parameters.beta + parameters.gamma, -1.0 / parameters.exponent);
  auto model = test::example<BoucWenModel>();
  double share = 0.0;
  for (double x = 0.0; x < 20.0 * largest; x += 0.01 * largest) {
    model.step(std::vector{x, 0.0});
    EXPECT_GE(model.state()[0], share);
    share = model.state()[0];
    EXPECT_LE(share, 1.0);
  }
  EXPECT_NEAR(share, 1.0, 1e-9);
  EXPECT_NEAR(model.step(std::vector{20.0 * largest, 0.0}).value,
              0.5 + 600.0 * 20.0 * largest + 600.0 * largest, 1e-6);
}

TEST(BoucWenModel, SolvesItsEquation) {
  auto model = test::example<BoucWenModel>();
  const auto& p = model.parameters();
  const double largest = std::pow(p.beta + p.gamma, -1.0 / p.exponent);
  double z = 0.0;
  double x = 0.0;
  model.step(std::vector{x, 0.0});
  // Runge-Kutta of the printed equation with steps 50 times as fine.
  for (const double turn : {0.8, -0.6, 0.3, -1.5, 2.0}) {
    const double dx = (turn * largest - x) / 5000;
    const auto slope = [&](double at) {
      const double sign = dx * at > 0.0 ? 1.0 : (dx * at < 0.0 ? -1.0 : 0.0);
      return 1.0 - std::pow(std::abs(at), p.exponent) * (p.beta * sign + p.gamma);
    };
    for (int n = 1; n <= 5000; ++n) {
      const double k1 = slope(z);
      const double k2 = slope(z + 0.5 * dx * k1);
      const double k3 = slope(z + 0.5 * dx * k2);
      const double k4 = slope(z + dx * k3);
      z += dx / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      x += dx;
      if (n % 50 != 0) continue;
      model.step(std::vector{x, 0.0});
      ASSERT_NEAR(model.state()[0] * largest, z, 1e-4 * largest);
    }
  }
}

TEST(NonlinearBacklash, KeepsBetweenItsBoundaries) {
  auto model = test::example<NonlinearBacklash>();
  const Envelope boundaries = model.parameters().boundaries;
  Random random(6);
  for (int n = 0; n < 2000; ++n) {
    const double x = 0.2 * random.uniform() - 0.1;
    const double torque = model.step(std::vector{x, 0.0}).value;
    EXPECT_LE(torque, boundaries.at(x).upper() + 1e-12);
    EXPECT_GE(torque, boundaries.at(x).lower() - 1e-12);
  }
}

TEST(ExponentialLoading, FollowsItsEquationFromTheLastReversal) {
  auto model = test::example<ExponentialLoading>();
  const auto& p = model.parameters();
  torques(model, path_through({0.0, 0.05, -0.03}, 1e-3));
  const double reversal_x = -0.03;
  const double reversal = model.step(std::vector{reversal_x, 0.0}).value;
  const double from = reversal - p.curves.at(reversal_x).upper();
  for (double x = reversal_x + 7e-4; x < 0.08; x += 7e-4)
    EXPECT_NEAR(model.step(std::vector{x, 0.0}).value,
                p.curves.at(x).upper() + from * std::exp(-p.rising_decay * (x - reversal_x)),
                1e-10);
}

TEST(Envelope, GoesOnStraightOutsideItsRange) {
  const Envelope envelope{
      .middle = {1.0, 2.0, 3.0}, .half_width = {1.0, -3.0}, .centre = 1.0, .half_range = 2.0};
  EXPECT_DOUBLE_EQ(envelope.at(1.0).middle, 1.0);
  EXPECT_DOUBLE_EQ(envelope.at(3.0).middle, 6.0);
  EXPECT_DOUBLE_EQ(envelope.at(5.0).middle, 6.0 + 8.0);
  EXPECT_DOUBLE_EQ(envelope.at(-1.0).half_width, 4.0);
  EXPECT_DOUBLE_EQ(envelope.at(-9.0).half_width, 4.0);
  EXPECT_DOUBLE_EQ(envelope.at(3.0).half_width, 0.0) << "boundaries do not cross";
}

TEST(HysteresisModels, RefuseWhatBreaksTheirPromises) {
  const auto refusal = [](auto example, const auto& change) {
    auto parameters = example.parameters();
    change(parameters);
    return test::error_message([&] { decltype(example){parameters}; });
  };
  EXPECT_THAT(
      refusal(test::example<MaxwellSlipModel>(), [](auto& p) { p.thresholds[1] = 1e-9; }),
      HasSubstr("maxwell_slip: thresholds: expected positive, ascending numbers, found 1e-09"));
  EXPECT_THAT(
      refusal(test::example<MaxwellSlipModel>(), [](auto& p) { p.thresholds.assign(7, 0.1); }),
      HasSubstr("maxwell_slip"));
  EXPECT_THAT(
      refusal(test::example<ImprovedPrandtlIshlinskii>(), [](auto& p) { p.bends[2] = -1.0; }),
      HasSubstr("rises everywhere"));
  EXPECT_THAT(refusal(test::example<BoucWenModel>(), [](auto& p) { p.gamma = 3001.0; }),
              HasSubstr("bouc_wen: gamma"));
  EXPECT_THAT(refusal(test::example<BoucWenModel>(), [](auto& p) { p.exponent = 0.9; }),
              HasSubstr("bouc_wen: exponent"));
  EXPECT_THAT(refusal(test::example<BoucWenModel>(), [](auto& p) { p.elastic_share = 1.2; }),
              HasSubstr("bouc_wen: elastic_share"));
  EXPECT_THAT(refusal(test::example<NonlinearBacklash>(), [](auto& p) { p.stiffness = 0.0; }),
              HasSubstr("nonlinear_backlash: stiffness"));
  EXPECT_THAT(refusal(test::example<NonlinearBacklash>(), [](auto& p) { p.rate.gain = 0.1; }),
              HasSubstr("rate.gain"));
  EXPECT_THAT(refusal(test::example<ExponentialLoading>(), [](auto& p) { p.slopes[0] = 1.0; }),
              HasSubstr("slope of the first input"));
  EXPECT_THAT(refusal(test::example<ExponentialLoading>(), [](auto& p) { p.falling_decay = -1.0; }),
              HasSubstr("exponential_loading: decay"));
}

TEST(BoucWenModel, AStepEndsAlsoAfterAStateWithAnAbsurdForce) {
  auto model = test::example<BoucWenModel>();
  static_cast<void>(torques(model, {0.0, 0.001, 0.002}));
  detail::StateBytes counted;
  model.visit_state(counted);
  std::vector<std::byte> bytes(counted.position());
  detail::StateBytes to(bytes);
  model.visit_state(to);
  const double absurd = -1e300;
  std::memcpy(bytes.data() + bytes.size() - sizeof absurd, &absurd, sizeof absurd);
  detail::StateBytes from(detail::StateBytes::Task::read, bytes);
  model.visit_state(from);
  for (const double torque : torques(model, {0.003, 0.004, -0.004}))
    EXPECT_TRUE(std::isfinite(torque));
}

}  // namespace
}  // namespace torsio
