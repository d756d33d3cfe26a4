#include "torsio/control/design/linear_system.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "control/design/frequency_response.hpp"
#include "control/design/loop_design.hpp"
#include "support/error_message.hpp"
#include "support/numbers.hpp"
#include "torsio/core/random.hpp"
#include "torsio/signal/differentiator.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

using test::kRate_Hz;
using Complex = std::complex<double>;

Complex z_at(double rad_s) { return std::polar(1.0, rad_s / kRate_Hz); }

Matrix matrix(std::size_t rows, std::size_t columns, std::vector<double> values) {
  Matrix result(rows, columns);
  result.values = std::move(values);
  return result;
}

/// K w^2 / (s^2 + 2 z w s + w^2) after a hold.
LinearSystem oscillator(double gain, double rad_s, double damping) {
  return LinearSystem::held(
      {matrix(2, 2, {0.0, 1.0, -rad_s * rad_s, -2.0 * damping * rad_s}),
       matrix(2, 1, {0.0, gain * rad_s * rad_s}), matrix(1, 2, {1.0, 0.0}), Matrix(1, 1)},
      kRate_Hz);
}

/// The outputs of a system step by step.
std::vector<double> run(const LinearSystem& system, const std::vector<double>& inputs) {
  const auto& [a, b, c, d] = system.matrices();
  std::vector<double> state(system.order(), 0.0);
  std::vector<double> outputs;
  for (const double u : inputs) {
    double y = d(0, 0) * u;
    std::vector<double> next(state.size(), 0.0);
    for (std::size_t i = 0; i < state.size(); ++i) {
      y += c(0, i) * state[i];
      next[i] = b(i, 0) * u;
      for (std::size_t j = 0; j < state.size(); ++j) next[i] += a(i, j) * state[j];
    }
    state = next;
    outputs.push_back(y);
  }
  return outputs;
}

std::vector<double> noise(std::size_t count) {
  Random random(7);
  std::vector<double> values(count);
  for (double& value : values) value = random.normal();
  values.front() = 0.0;  // the filters start in the steady state of their first input
  return values;
}

TEST(LinearSystem, IsTheLowpassAndTheDifferenceThatRunInTheLoop) {
  const std::vector<double> inputs = noise(500);
  const auto filtered = run(LinearSystem::lowpass(120.0, kRate_Hz), inputs);
  const auto differences = run(LinearSystem::difference(kRate_Hz), inputs);
  Lowpass lowpass(120.0, kRate_Hz);
  Differentiator differentiator(kRate_Hz);
  for (std::size_t n = 0; n < inputs.size(); ++n) {
    EXPECT_NEAR(filtered[n], lowpass.step(inputs[n]), 1e-12);
    EXPECT_NEAR(differences[n], differentiator.step(inputs[n]), 1e-9);
  }
}

TEST(LinearSystem, HasTheResponsesOfItsParts) {
  for (const double rad_s : {0.1, 30.0, 700.0, 3000.0}) {
    const Complex z = z_at(rad_s);
    const auto near = [&](const LinearSystem& system, Complex expected) {
      EXPECT_LT(std::abs(system.response(rad_s) - expected), 1e-9 * (1.0 + std::abs(expected)));
    };
    const LinearSystem delay = LinearSystem::delay(kRate_Hz);
    const LinearSystem integrator = LinearSystem::integrator(kRate_Hz);
    near(delay, 1.0 / z);
    near(integrator, 1e-3 / (z - 1.0));
    near(LinearSystem::difference(kRate_Hz), (1.0 - 1.0 / z) * kRate_Hz);
    near(delay * integrator, 1e-3 / (z - 1.0) / z);
    near(delay + integrator, 1e-3 / (z - 1.0) + 1.0 / z);
    near((delay + LinearSystem::gain(0.5, kRate_Hz)).closed(),
         (1.0 / z + 0.5) / (1.0 + 1.0 / z + 0.5));
    const LinearSystem both = side_by_side(delay, integrator);
    EXPECT_LT(std::abs(both.response(rad_s, 0, 1) - integrator.response(rad_s)), 1e-9);
  }
}

// The step response of an oscillator, at the samples.
TEST(LinearSystem, HoldsItsInputExactlyBetweenTheSamples) {
  constexpr double kFrequency = 300.0;
  constexpr double kDamping = 0.2;
  const LinearSystem system = oscillator(2.0, kFrequency, kDamping);
  const auto outputs = run(system, std::vector<double>(100, 1.0));
  const double root = std::sqrt(1.0 - kDamping * kDamping);
  for (std::size_t n = 0; n < outputs.size(); ++n) {
    const double angle = kFrequency * root * static_cast<double>(n) / kRate_Hz;
    const double envelope = std::exp(-kDamping * kFrequency * static_cast<double>(n) / kRate_Hz);
    EXPECT_NEAR(outputs[n],
                2.0 - 2.0 * envelope * (std::cos(angle) + kDamping / root * std::sin(angle)),
                1e-12);
  }
}

// k / s with a hold and d samples of delay: |L| = 1 at about k, where the delay costs (d + 1/2) k T.
TEST(Margins, OfAnIntegratorWithDelayAreThoseOfTheTextbook) {
  const LinearSystem integrator = LinearSystem::held(
      {Matrix(1, 1), Matrix(1, 1, 50.0), Matrix(1, 1, 1.0), Matrix(1, 1)}, kRate_Hz);
  const Margins found = margins(LinearSystem::delay(kRate_Hz) * integrator);
  EXPECT_TRUE(found.is_stable);
  // |T k / (z - 1)| = 1 where 2 sin(w T / 2) = k T.
  const double crossover_rad_s = 2.0 * kRate_Hz * std::asin(0.025);
  EXPECT_NEAR(found.crossover_rad_s, crossover_rad_s, 1e-6);
  EXPECT_NEAR(found.phase_rad, 0.5 * std::numbers::pi - 1.5 * crossover_rad_s / kRate_Hz, 1e-9);
  // -180 degrees where 1.5 w T = pi / 2, with the gain k T / (2 sin(pi / 6)).
  EXPECT_NEAR(found.gain_rad_s, std::numbers::pi / 3.0 * kRate_Hz, 1e-6);
  EXPECT_NEAR(found.gain, 1.0 / 0.05, 1e-9);
  EXPECT_EQ(found.least_gain, 0.0);
}

TEST(FrequencyResponse, IsThatOfTheSystemForAnyMatrices) {
  Random random(5);
  for (std::size_t order = 0; order < 9; ++order) {
    const auto any = [&](std::size_t rows, std::size_t columns) {
      Matrix made(rows, columns);
      for (double& value : made.values) value = random.normal();
      return made;
    };
    const LinearSystem system({any(order, order), any(order, 2), any(2, order), any(2, 2)},
                              kRate_Hz);
    FrequencyResponse response(system, 1, 0);
    for (const double rad_s : {0.0, 1.0, 37.0, 900.0, 3000.0}) {
      const Complex expected = system.response(rad_s, 1, 0);
      EXPECT_LT(std::abs(response.at(rad_s) - expected), 1e-9 * (1.0 + std::abs(expected)))
          << order << ", " << rad_s;
    }
  }
}

TEST(Margins, AgreeWithThePolesOnWhereStabilityEnds) {
  const auto loop = [](double gain) {
    return LinearSystem::delay(kRate_Hz) * oscillator(gain, 60.0, 0.1) *
           (LinearSystem::gain(1.0, kRate_Hz) +
            LinearSystem::gain(20.0, kRate_Hz) * LinearSystem::integrator(kRate_Hz));
  };
  const Margins found = margins(loop(0.1));
  EXPECT_TRUE(found.is_stable);
  EXPECT_TRUE(margins(loop(0.1 * found.gain * 0.999)).is_stable);
  EXPECT_FALSE(margins(loop(0.1 * found.gain * 1.001)).is_stable);
  EXPECT_NEAR(loop(0.1 * found.gain).closed().spectral_radius(), 1.0, 1e-9);
}

TEST(LinearSystem, RefusesWhatDoesNotFit) {
  const auto refusal = [](auto work) { return test::error_message(work); };
  EXPECT_NE(refusal([] {
              LinearSystem({Matrix(2, 2), Matrix(1, 1), Matrix(1, 2), Matrix(1, 1)}, kRate_Hz);
            }).find("rows of B"),
            std::string::npos);
  EXPECT_NE(refusal([] { return LinearSystem::gain(1.0, 0.0); }), "");
  EXPECT_NE(refusal([] { return LinearSystem::gain(std::nan(""), kRate_Hz); }), "");
  EXPECT_NE(refusal([] { return LinearSystem::lowpass(600.0, kRate_Hz); }), "");
  const LinearSystem two =
      side_by_side(LinearSystem::delay(kRate_Hz), LinearSystem::delay(kRate_Hz));
  const LinearSystem slow = LinearSystem::delay(0.1 * kRate_Hz);
  const LinearSystem one = LinearSystem::delay(kRate_Hz);
  EXPECT_NE(refusal([&] { return slow * one; }).find("one sample rate"), std::string::npos);
  EXPECT_NE(refusal([&] { return slow + one; }).find("one sample rate"), std::string::npos);
  EXPECT_NE(refusal([&] { return side_by_side(one, slow); }).find("one sample rate"),
            std::string::npos);
  EXPECT_NE(refusal([&] { return margins(two); }), "");
  EXPECT_NE(refusal([&] { return two * LinearSystem::delay(kRate_Hz); }), "");
  EXPECT_NE(refusal([&] { return (two + LinearSystem::delay(kRate_Hz)); }), "");
  EXPECT_NE(refusal([&] { return (two.closed()); }), "");
  EXPECT_NE(refusal([&] { return (two.response(1.0, 0, 2)); }), "");
  EXPECT_NE(refusal([&] { return (LinearSystem::gain(-1.0, kRate_Hz).closed()); }), "");
}

}  // namespace
}  // namespace torsio
