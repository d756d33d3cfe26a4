#include "model/viscoelastic/viscoelastic.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <unsupported/Eigen/MatrixFunctions>
#include <utility>
#include <vector>

#include "support/error_message.hpp"
#include "support/random_spring_dashpots.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;

constexpr double kPeriod_s = 5e-3;

Viscoelastic model_of(SpringDashpotNetwork network, double period_s = kPeriod_s,
                      double offset = 0.0) {
  return Viscoelastic(
      {.network = std::move(network), .offset = offset, .sample_period_s = period_s, .inputs = 1});
}
Viscoelastic model_of(const char* text, double period_s = kPeriod_s, double offset = 0.0) {
  return model_of(parse_network(text), period_s, offset);
}

double step(Viscoelastic& model, double u) { return model.step(std::vector<double>{u}).value; }

/// Slow, fast and still, from 0.
std::vector<double> deflection(std::size_t samples, std::uint64_t seed) {
  Random random(seed);
  std::vector<double> u(samples, 0.0);
  double rate = 0.0;
  for (std::size_t n = 1; n < samples; ++n) {
    rate = 0.97 * rate + (n % 300 < 200 ? 2e-4 * random.normal() : -0.2 * rate);
    u[n] = u[n - 1] + rate;
  }
  return u;
}

/// x' = A x + B u, y = C x + D u, by the exponential of a matrix that holds the ramp of the input
/// too (van Loan).
struct StateSpace {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;
  Eigen::RowVectorXd c;
  double d = 0.0;

  [[nodiscard]] std::vector<double> response(const std::vector<double>& u, double period_s) const {
    const auto n = a.rows();
    Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(n + 2, n + 2);
    whole.topLeftCorner(n, n) = a;
    whole.block(0, n, n, 1) = b;
    whole(n, n + 1) = 1.0;
    const Eigen::MatrixXd over_a_step = (whole * period_s).exp();
    Eigen::VectorXd state = Eigen::VectorXd::Zero(n + 2);
    std::vector<double> y{d * u.front()};
    for (std::size_t i = 1; i < u.size(); ++i) {
      state[n] = u[i - 1];
      state[n + 1] = (u[i] - u[i - 1]) / period_s;
      state = over_a_step * state;
      y.push_back(c * state.head(n) + d * u[i]);
    }
    return y;
  }
};

// Specification 3.6 (a).
StateSpace explicit_a(double k1, double d1, double k2, double d2, double k3) {
  StateSpace of{Eigen::Matrix2d{{-(k3 + k1) / d1, -k3 / d1}, {-k3 / d2, -(k3 + k2) / d2}},
                Eigen::Vector2d{k3 / d1, k3 / d2}, Eigen::RowVector2d{-k3, -k3}, k3};
  return of;
}

// Specification 3.6 (b).
StateSpace explicit_b(double k2, double d2, double k3, double k5, double k6, double d3) {
  return {Eigen::Matrix2d{{-(k3 + k2) / d2, 0.0}, {0.0, -k6 / d3}},
          Eigen::Vector2d{k3 / d2, k6 / d3}, Eigen::RowVector2d{-k3, -k6}, k5 + k6 + k3};
}

// Specification 3.6 (c).
StateSpace explicit_c(double k1, double d1, double k7, double k5, double k6, double d3, double k4,
                      double d4) {
  // In x = (x1, v3, v4): y = (k7 (u - x1) + k6 v3 + k4 v4) / sum.
  const double sum = k4 + k5 + k6 + k7;
  const Eigen::RowVector3d y_x{-k7 / sum, k6 / sum, k4 / sum};
  const double y_u = k7 / sum;
  const Eigen::RowVector3d torque_x = Eigen::RowVector3d{-k7, 0.0, 0.0} - k7 * y_x;
  const double torque_u = k7 * (1.0 - y_u);
  StateSpace of{Eigen::MatrixXd::Zero(3, 3), Eigen::Vector3d::Zero(), torque_x, torque_u};
  of.a.row(0) = torque_x / d1;
  of.a(0, 0) -= k1 / d1;
  of.b[0] = torque_u / d1;
  of.a.row(1) = k6 / d3 * y_x;
  of.a(1, 1) -= k6 / d3;
  of.b[1] = k6 / d3 * y_u;
  of.a.row(2) = k4 / d4 * y_x;
  of.a(2, 2) -= k4 / d4;
  of.b[2] = k4 / d4 * y_u;
  return of;
}

void expect_response(const char* name, const StateSpace& expected) {
  Viscoelastic model = model_of(name);
  const std::vector<double> u = deflection(3000, 1);
  const std::vector<double> y = expected.response(u, kPeriod_s);
  double largest = 0.0;
  for (const double value : y) largest = std::max(largest, std::abs(value));
  ASSERT_GT(largest, 0.1);
  for (std::size_t n = 0; n < u.size(); ++n)
    ASSERT_NEAR(step(model, u[n]), y[n], 1e-12 * largest) << name << ", sample " << n;
}

TEST(Viscoelastic, IsTheStateSpaceOfTheSpecification) {
  const auto v = [](const char* name) { return parse_network(name).values(); };
  const auto a = v("003a");
  expect_response("003a", explicit_a(a[0], a[1], a[2], a[3], a[4]));
  const auto b = v("003b");
  expect_response("003b", explicit_b(b[0], b[1], b[2], b[5], b[3], b[4]));
  const auto c = v("003c");
  expect_response("003c", explicit_c(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]));
}

// Specification 3.7: k_inf + k1 exp(-t k1 / d).
TEST(Viscoelastic, RelaxesAsTheStandardLinearSolidDoes) {
  Viscoelastic model = model_of("parallel(k0=300, maxwell(k1=120, d1=30))", 1e-3);
  (void)step(model, 0.0);
  // A jump within one step: the branch has relaxed within it already, as the ramp shows.
  const double held = -std::expm1(-1e-3 * 4.0) / (1e-3 * 4.0);
  for (int n = 0; n < 2000; ++n)
    ASSERT_NEAR(step(model, 0.1), 30.0 + 12.0 * held * std::exp(-n * 1e-3 * 4.0), 1e-12) << n;
}

TEST(Viscoelastic, IsExactOnARampAtAnyStep) {
  for (const double period_s : {1e-4, 5e-3, 0.5}) {
    Viscoelastic sls = model_of("parallel(k0=300, maxwell(k1=120, d1=30))", period_s);
    Viscoelastic kelvin_voigt = model_of("kv(k1=300, d1=20)", period_s);
    (void)step(sls, 0.0);
    (void)step(kelvin_voigt, 0.0);
    for (int n = 1; n < 50; ++n) {
      const double t = n * period_s;
      ASSERT_NEAR(step(sls, 0.2 * t), 60.0 * t + 6.0 * -std::expm1(-4.0 * t), 1e-11);
      ASSERT_NEAR(step(kelvin_voigt, 0.2 * t), 60.0 * t + 4.0, 1e-11);
    }
  }
}

TEST(Viscoelastic, HasTheSameOutputAtHalfTheRateOnRamps) {
  Viscoelastic fine = model_of("003c", 1e-3);
  Viscoelastic coarse = model_of("003c", 2e-3);
  for (int n = 0; n < 400; ++n) {
    const auto u = [](int at) {
      return at % 100 < 50 ? 1e-3 * (at % 100) : 1e-3 * (100 - at % 100);
    };
    const double expected = step(fine, u(n));
    if (n % 2 == 0) {
      ASSERT_NEAR(step(coarse, u(n)), expected, 1e-12) << n;
    }
  }
}

TEST(Viscoelastic, BurgersFollowsItsDifferentialEquation) {
  constexpr double kK1 = 200.0;
  constexpr double kD1 = 50.0;
  constexpr double kK2 = 80.0;
  constexpr double kD2 = 5.0;
  constexpr double kStep_s = 1e-4;
  Viscoelastic model = model_of("series(maxwell(k1=200, d1=50), kv(k2=80, d2=5))", kStep_s);
  const auto u = [](double t) { return 0.1 * std::sin(3.0 * t); };
  std::vector<double> y;
  for (int n = 0; n < 20000; ++n) y.push_back(step(model, u(n * kStep_s)));
  for (std::size_t n = 100; n + 1 < y.size(); n += 371) {
    const double t = static_cast<double>(n) * kStep_s;
    const double rate = (y[n + 1] - y[n - 1]) / (2.0 * kStep_s);
    const double second = (y[n + 1] - 2.0 * y[n] + y[n - 1]) / (kStep_s * kStep_s);
    const double left =
        second * kD1 * kD2 / (kK1 * kK2) + rate * (kD1 / kK1 + kD1 / kK2 + kD2 / kK2) + y[n];
    const double right = kD1 * 0.3 * std::cos(3.0 * t) - kD1 * kD2 / kK2 * 0.9 * std::sin(3.0 * t);
    EXPECT_NEAR(left, right, 2e-4) << t;
  }
}

TEST(Viscoelastic, GivesNoWorkOverAClosedCycle) {
  rc::check("work from rest over closed paths", [](std::uint64_t seed) {
    Random random(seed);
    Viscoelastic model = model_of(test::random_spring_dashpots(random, 1e-2, 1e2));
    std::vector<double> u = deflection(400, seed);
    const double last = u.back();
    for (std::size_t n = 0; n < u.size(); ++n)  // closed, and starting at rest
      u[n] -= last * static_cast<double>(n) / static_cast<double>(u.size() - 1);
    double work = 0.0;
    double through = 0.0;
    std::vector<double> before(model.state().begin(), model.state().end());
    (void)step(model, u[0]);
    for (std::size_t n = 1; n < u.size(); ++n) {
      const double moved = u[n] - u[n - 1];
      // Exact over a step: int z dt = (g du - (z1 - z0)) / p of every branch.
      double mean = model.spectrum().stiffness * 0.5 * (u[n] + u[n - 1]) +
                    model.spectrum().damping * moved / kPeriod_s;
      (void)step(model, u[n]);
      for (std::size_t i = 0; i < before.size(); ++i) {
        const auto& branch = model.spectrum().branches[i];
        const double z = model.state()[i];
        const double passed = branch.rate_1_s * kPeriod_s;
        mean += passed > 1e-6 ? (branch.stiffness * moved - (z - before[i])) / passed
                              : 0.5 * (z + before[i]);
        before[i] = z;
      }
      work += mean * moved;
      through += std::abs(mean * moved);
    }
    RC_ASSERT(work >= -1e-9 * through);
  });
}

TEST(Viscoelastic, StaysAccurateWithStiffAndNearlyIntegratingParts) {
  // 1000 /s and 1e-9 /s at 5 ms.
  Viscoelastic model = model_of("parallel(k0=1, maxwell(k1=10, d1=0.01), maxwell(k2=10, d2=1e10))");
  (void)step(model, 0.0);
  for (int n = 0; n < 1'000'000; ++n) (void)step(model, 0.3 * std::sin(0.001 * n));
  const double u = 0.3 * std::sin(0.001 * 999'999);
  EXPECT_NEAR(step(model, u), 11.0 * u, 1e-4);  // the slow one is a spring yet, to 5000 s / 1e9 s
}

TEST(Viscoelastic, StartsRelaxedOrFromTheGivenState) {
  Viscoelastic model = model_of("parallel(k0=300, maxwell(k1=120, d1=30))", 1e-3, 2.0);
  EXPECT_EQ(step(model, 0.1), 32.0);
  EXPECT_EQ(step(model, 0.1), 32.0);
  model.reset();
  ASSERT_EQ(model.state().size(), 1U);
  model.set_state(std::vector<double>{5.0});
  EXPECT_EQ(step(model, 0.1), 37.0);
  EXPECT_NEAR(step(model, 0.1), 32.0 + 5.0 * std::exp(-4e-3), 1e-13);
  model.set_state(std::vector<double>{kNotMeasured});
  EXPECT_NEAR(step(model, 0.1), 32.0 + 5.0 * std::exp(-8e-3), 1e-13);
}

TEST(Viscoelastic, HoldsItsLastValueWhereTheInputIsNoNumber) {
  Viscoelastic model = model_of("003a");
  (void)step(model, 0.0);
  const double value = step(model, 0.01);
  for (const double bad : {kNotMeasured, HUGE_VAL, -HUGE_VAL}) {
    const Estimate estimate = model.step(std::vector<double>{bad});
    EXPECT_EQ(estimate.fault, Fault::input_not_finite);
    EXPECT_NEAR(estimate.value, value, 1e-14);
  }
  Viscoelastic never_failed = model_of("003a");
  (void)step(never_failed, 0.0);
  (void)step(never_failed, 0.01);
  EXPECT_EQ(step(model, 0.02), step(never_failed, 0.02));
  const Estimate too_large = model.step(std::vector<double>{1.7e308});
  EXPECT_EQ(too_large.fault, Fault::model_not_finite);
  EXPECT_EQ(too_large.value, 0.0);
  EXPECT_EQ(step(model, 0.0), 0.0) << "at rest again";
}

TEST(Viscoelastic, HasNoInverseWhereItHasNotMovedAndIsAFluid) {
  Viscoelastic fluid = model_of("maxwell(k1=5, d1=1)");
  EXPECT_EQ(fluid.invert(1.0, std::vector<double>{0.25}).fault, Fault::model_not_finite);
  EXPECT_EQ(fluid.invert(1.0, std::vector<double>{0.25}).value, 0.25);
  (void)step(fluid, 0.0);
  const double value = step(fluid, 0.1);
  EXPECT_NEAR(fluid.invert(value, std::vector<double>{9.0}).value, 0.1, 1e-15);
}

TEST(Viscoelastic, RefusesParametersThatMakeNoSense) {
  const auto message = [](Viscoelastic::Parameters parameters) {
    return test::error_message([&] { (void)Viscoelastic(std::move(parameters)); });
  };
  const Viscoelastic::Parameters good{
      .network = parse_network("k1=3"), .sample_period_s = 1e-3, .inputs = 1};
  EXPECT_EQ(message(good), "");
  auto bad = good;
  bad.sample_period_s = 0.0;
  EXPECT_THAT(message(bad), HasSubstr("viscoelastic: sample_period_s: expected a positive number"));
  bad.sample_period_s = -1e-9;
  EXPECT_THAT(message(bad), HasSubstr("found -1e-09")) << "not -0.000000";
  bad = good;
  bad.offset = kNotMeasured;
  EXPECT_THAT(message(bad), HasSubstr("viscoelastic: offset: expected a finite number"));
  bad = good;
  bad.inputs = 0;
  EXPECT_THAT(message(bad), HasSubstr("viscoelastic: inputs: expected at least 1"));
  bad = good;
  bad.network = parse_network("k1");
  EXPECT_THAT(message(bad), HasSubstr("network: node 0: expected k1 from 1e-12 to 1e+12"));
}

}  // namespace
}  // namespace torsio
