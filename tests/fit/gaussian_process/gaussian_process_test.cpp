// What the fits of Gaussian processes rest on, against finite differences and dense algebra.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "fit/gaussian_process/gp_descent.hpp"
#include "fit/gaussian_process/marginal_likelihood.hpp"
#include "fit/gaussian_process/parametric_gp_trainer.hpp"
#include "fit/gaussian_process/sparse_posterior.hpp"
#include "numerics/lbfgs.hpp"
#include "support/error_message.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kInputs = 5;
const std::string kCombined = "se*(linear+periodic*rq)";

Matrix random_points(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Matrix points(count, kInputs);
  for (double& value : points.values) value = random.normal();
  return points;
}

std::vector<double> targets_of(const Matrix& points) {
  Random random(11);
  std::vector<double> target;
  for (std::size_t n = 0; n < points.rows; ++n)
    target.push_back(std::sin(points(n, 0)) + 0.3 * points(n, 1) + 0.1 * random.normal());
  return target;
}

Kernel some_kernel(const std::string& text = kCombined) {
  Kernel kernel(parse_kernel(text, kInputs), kInputs);
  std::vector<double> numbers = kernel.log_parameters();
  for (std::size_t p = 0; p < numbers.size(); ++p)
    numbers[p] = 0.3 * std::sin(1.3 * static_cast<double>(p)) + 0.3;
  kernel.set_log_parameters(numbers);
  return kernel;
}

/// k of all rows of two tables.
MatrixXd covariance(const Kernel& kernel, const Matrix& a, const Matrix& b) {
  const PackedPoints points(b);
  detail::AlignedVector<double> values(points.padded_size());
  MatrixXd result(a.rows, b.rows);
  for (std::size_t i = 0; i < a.rows; ++i) {
    kernel.row(a.row(i).data(), points, b.rows, values.data());
    for (std::size_t j = 0; j < b.rows; ++j)
      result(static_cast<Index>(i), static_cast<Index>(j)) = values[j];
  }
  return result;
}

VectorXd vector_of(std::span<const double> values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Index>(values.size()));
}

double log_normal(const MatrixXd& covariance_of_y, const VectorXd& y) {
  const Eigen::LLT<MatrixXd> factor(covariance_of_y);
  return -0.5 * (y.dot(factor.solve(y)) + 2.0 * factor.matrixLLT().diagonal().array().log().sum() +
                 static_cast<double>(y.size()) * std::log(2.0 * std::numbers::pi));
}

using Objective = std::function<double(const std::vector<double>&)>;

void expect_gradient(const std::vector<double>& gradient, const std::vector<double>& at,
                     const Objective& f, double scale) {
  constexpr double kStep = 1e-5;
  for (std::size_t p = 0; p < at.size(); ++p) {
    auto more = at;
    auto less = at;
    more[p] += kStep;
    less[p] -= kStep;
    const double expected = (f(more) - f(less)) / (2.0 * kStep);
    EXPECT_NEAR(gradient[p], expected, 1e-6 * std::max(scale, std::abs(expected)))
        << "number " << p;
  }
}

TEST(Lbfgs, FindsTheBottomOfABananaAndOfABoundedOne) {
  const Differentiable banana = [](std::span<const double> x, std::span<double> gradient) {
    const double off = x[1] - x[0] * x[0];
    gradient[0] = -2.0 * (1.0 - x[0]) - 400.0 * x[0] * off;
    gradient[1] = 200.0 * off;
    return (1.0 - x[0]) * (1.0 - x[0]) + 100.0 * off * off;
  };
  const LbfgsResult free = minimise(banana, {-1.2, 1.0}, {.tolerance = 1e-16});
  EXPECT_NEAR(free.at[0], 1.0, 1e-5);
  EXPECT_NEAR(free.at[1], 1.0, 1e-5);
  const LbfgsResult bound = minimise(
      banana, {-1.2, 1.0}, {.tolerance = 1e-16, .lowest = {-5.0, -5.0}, .highest = {0.5, 5.0}});
  EXPECT_DOUBLE_EQ(bound.at[0], 0.5);
  EXPECT_NEAR(bound.at[1], 0.25, 1e-6);
}

TEST(Lbfgs, StepsBackFromWhereTheFunctionEnds) {
  const Differentiable f = [](std::span<const double> x, std::span<double> gradient) {
    gradient[0] = 1.0 - 1.0 / x[0];
    return x[0] - std::log(x[0]);  // NaN below 0
  };
  EXPECT_NEAR(minimise(f, {1.9}, {.tolerance = 1e-14}).at[0], 1.0, 1e-5);
  EXPECT_EQ(minimise(f, {-1.0}, {}).at[0], -1.0) << "a start of no value stays";
}

TEST(MarginalLikelihood, IsTheDensityOfTheTargetsAndHasItsGradient) {
  const Matrix points = random_points(60, 1);
  const std::vector<double> target = targets_of(points);
  for (const std::string& text :
       {kCombined, std::string("se_ard+linear_ard"), std::string("matern32*periodic_ard+rq_ard"),
        std::string("matern52_ard")}) {
    SCOPED_TRACE(text);
    const Kernel kernel = some_kernel(text);
    MarginalLikelihood process(kernel, points, target);
    std::vector<double> at = kernel.log_parameters();
    at.push_back(std::log(0.05));
    std::vector<double> gradient(at.size());
    const double value = process.evaluate(at, gradient);
    const MatrixXd k = covariance(kernel, points, points) + 0.05 * MatrixXd::Identity(60, 60);
    EXPECT_NEAR(value, -log_normal(k, vector_of(target)), 1e-9 * std::abs(value));
    expect_gradient(
        gradient, at, [&](const auto& x) { return process.fix(x); }, 1.0);
  }
}

TEST(MarginalLikelihood, LeavesOneOutAsIfItWereNotThere) {
  const Matrix points = random_points(25, 2);
  const std::vector<double> target = targets_of(points);
  const Kernel kernel = some_kernel();
  MarginalLikelihood process(kernel, points, target);
  std::vector<double> at = kernel.log_parameters();
  at.push_back(std::log(0.05));
  (void)process.fix(at);
  const LeaveOneOut found = process.leave_one_out();

  const MatrixXd k = covariance(kernel, points, points) + 0.05 * MatrixXd::Identity(25, 25);
  double squares = 0.0;
  double log_density = 0.0;
  for (Index out = 0; out < 25; ++out) {
    std::vector<Index> rest;
    for (Index i = 0; i < 25; ++i)
      if (i != out) rest.push_back(i);
    const MatrixXd kept = k(rest, rest);
    const VectorXd q = k(rest, out);
    const VectorXd y = vector_of(target)(rest);
    const double mean = q.dot(kept.llt().solve(y));
    const double variance = k(out, out) - q.dot(kept.llt().solve(q));
    const double error = target[static_cast<std::size_t>(out)] - mean;
    squares += error * error;
    log_density -= 0.5 * (std::log(2.0 * std::numbers::pi * variance) + error * error / variance);
  }
  EXPECT_NEAR(found.rmse, std::sqrt(squares / 25.0), 1e-10);
  EXPECT_NEAR(found.log_density, log_density / 25.0, 1e-10);
}

/// A trainer that has seen some samples and is asked about another.
struct Trained {
  Matrix points = random_points(7, 3);
  Matrix features = random_points(40, 4);
  std::vector<double> target = targets_of(features);
  ParametricGpTrainer trainer{some_kernel(), points, 0.05};

  Trained() {
    for (std::size_t n = 1; n < features.rows; ++n) {
      (void)trainer.predict(features.row(n));
      trainer.take_in(target[n]);
    }
  }

  /// The value of `f` for another trainer with those numbers and the same (m, S).
  Objective objective(const std::function<double(ParametricGpTrainer&)>& f) const {
    return [this, f](const std::vector<double>& numbers) {
      ParametricGpTrainer other = trainer;
      EXPECT_TRUE(other.set_parameters(numbers));
      return f(other);
    };
  }
};

double divergence(const ParametricGpTrainer& trainer) {
  const MatrixXd& s = trainer.covariance();
  const MatrixXd& k = trainer.prior();
  const auto log_det = [](const MatrixXd& matrix) { return std::log(matrix.determinant()); };
  return 0.5 * ((k.llt().solve(s)).trace() + trainer.mean().dot(k.llt().solve(trainer.mean())) -
                static_cast<double>(s.rows()) + log_det(k) - log_det(s));
}

TEST(ParametricGpTrainer, ItsGradientsAreThoseOfFiniteDifferences) {
  const Trained t;
  ParametricGpTrainer trainer = t.trainer;
  const std::vector<double> at = trainer.parameters();
  std::vector<double> gradient(at.size());
  (void)trainer.predict(t.features.row(0));
  trainer.add_data_gradient(t.target[0], 1.0);
  trainer.add_noise_gradient(t.target[0], 1.0);
  trainer.take_gradient(gradient);
  expect_gradient(gradient, at, t.objective([&](ParametricGpTrainer& other) {
    const auto [mean, variance] = other.predict(t.features.row(0));
    const double error = t.target[0] - mean;
    const double noise = other.noise_variance();
    return (error * error + variance) / (2.0 * noise) + 0.5 * std::log(noise);
  }),
                  0.1);

  trainer.add_divergence_gradient(0.25);
  trainer.take_gradient(gradient);
  expect_gradient(gradient, at,
                  t.objective([](ParametricGpTrainer& other) { return 0.25 * divergence(other); }),
                  0.1);

  trainer.add_nlml_gradient();
  trainer.take_gradient(gradient);
  expect_gradient(gradient, at, t.objective([](ParametricGpTrainer& other) {
    const MatrixXd& k = other.prior();
    return 0.5 * (other.mean().dot(k.llt().solve(other.mean())) + std::log(k.determinant()));
  }),
                  0.1);
}

TEST(ParametricGpTrainer, SampleBySampleItIsFitc) {
  const Matrix points = random_points(7, 3);
  const Matrix features = random_points(60, 4);
  const std::vector<double> target = targets_of(features);
  const Kernel kernel = some_kernel();
  ParametricGpTrainer trainer(kernel, points, 0.01);
  for (std::size_t n = 0; n < features.rows; ++n) {
    (void)trainer.predict(features.row(n));
    trainer.take_in(target[n]);
  }
  // The posterior of a batch, dense.
  const MatrixXd& k = trainer.prior();
  const MatrixXd p = covariance(kernel, points, features);
  VectorXd lambda(60);
  for (Index n = 0; n < 60; ++n)
    lambda(n) = kernel.self(features.row(static_cast<std::size_t>(n)).data()) -
                p.col(n).dot(k.llt().solve(p.col(n))) + 0.01;
  const MatrixXd a = k + p * lambda.cwiseInverse().asDiagonal() * p.transpose();
  const VectorXd b = p * vector_of(target).cwiseQuotient(lambda);
  const VectorXd m = k * a.llt().solve(b);
  const MatrixXd s = k * a.llt().solve(k);
  EXPECT_LT((trainer.mean() - m).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((trainer.covariance() - s).cwiseAbs().maxCoeff(), 1e-10);

  const SparsePosterior posterior =
      sparse_posterior(kernel, points, 0.01, features, target, SparseNoise::fitc);
  EXPECT_LT((vector_of(posterior.weights) - a.llt().solve(b)).cwiseAbs().maxCoeff(), 1e-10);
  const MatrixXd c = k.inverse() - a.inverse();
  EXPECT_LT((vector_of(posterior.explained.values) -
             Eigen::Map<const VectorXd>(MatrixXd(c.transpose()).data(), c.size()))
                .cwiseAbs()
                .maxCoeff(),
            1e-10);
}

/// theta from what a combined kernel stores, in the order of the storage: 1 / l of the linear one.
std::vector<double> theta_of(const Kernel& kernel) {
  std::vector<double> theta;
  const std::vector<ThetaForm> forms = theta_forms(kernel.expression());
  const std::vector<double> numbers = kernel.log_parameters();
  for (std::size_t p = 0; p < forms.size(); ++p)
    theta.push_back(forms[p] == ThetaForm::offset              ? numbers[p]
                    : forms[p] == ThetaForm::inverse_logarithm ? std::exp(-numbers[p])
                                                               : std::exp(numbers[p]));
  return theta;
}

TEST(GpDescent, APlainStepFollowsTheGradientByThetaOrByItsLogarithm) {
  constexpr double kRate = 1e-3;
  const Trained t;
  // Before anything is learned the gradient is not small.
  const ParametricGpTrainer start(some_kernel(), t.points, 0.05);
  Table one{.features = Matrix(1, kInputs), .target = {t.target[0]}};
  std::ranges::copy(t.features.row(0), one.features.values.begin());
  const std::vector<double> theta = theta_of(start.kernel());
  const std::vector<ThetaForm> forms = theta_forms(start.kernel().expression());
  ASSERT_EQ(forms.size(), 8U) << "two of the nine theta are one, since theta_1 has no place here";
  const auto objective = [&](const std::vector<double>& of) {
    ParametricGpTrainer other = start;
    std::vector<double> numbers;
    for (std::size_t p = 0; p < of.size(); ++p)
      numbers.push_back(forms[p] == ThetaForm::offset              ? of[p]
                        : forms[p] == ThetaForm::inverse_logarithm ? -std::log(of[p])
                                                                   : std::log(of[p]));
    numbers.push_back(std::log(0.05));
    EXPECT_TRUE(other.set_parameters(numbers));
    const auto [mean, variance] = other.predict(one.features.row(0));
    const double error = one.target[0] - mean;
    return (error * error + variance) / 0.1;
  };
  for (const ThetaStep step : {ThetaStep::plain, ThetaStep::logarithm}) {
    GpDescent descent{start};
    Random random(1);
    descend(descent, one, {.step = step, .rate = kRate, .updates = 1}, random, {});
    EXPECT_EQ(descent.updates, 1U);
    const std::vector<double> moved = theta_of(descent.trainer.kernel());
    for (std::size_t p = 0; p < theta.size(); ++p) {
      std::vector<double> more = theta;
      std::vector<double> less = theta;
      more[p] += 1e-5;
      less[p] -= 1e-5;
      const double slope = (objective(more) - objective(less)) / 2e-5;
      const double expected = step == ThetaStep::plain
                                  ? theta[p] - kRate * slope
                                  : theta[p] * std::exp(-kRate * slope * theta[p]);
      EXPECT_NEAR(moved[p], expected, 1e-6 * (1.0 + std::abs(theta[p]))) << "number " << p;
    }
  }
}

// theta_8 below 0: the step follows the gradient by theta itself, and ends where its sign would change.
constexpr double kShape = -2.0;

/// theta_8 after one plain step on one sample, and why the descent ended.
std::pair<double, std::string> shape_after(double target, double rate) {
  KernelExpression expression = parse_kernel("rq", 1);
  expression.nodes[0].shape = kShape;
  Matrix points(2, 1);
  points.values = {-0.3, 0.4};
  Table one{.features = Matrix(1, 1), .target = {target}};
  one.features.values = {0.9};
  GpDescent descent{ParametricGpTrainer(Kernel(expression, 1), points, 0.05)};
  // While the mean is 0, the slope does not depend on the target.
  static_cast<void>(descent.trainer.predict(one.features.row(0)));
  descent.trainer.take_in(1.0);
  Random random(1);
  descend(
      descent, one,
      {.objective = KernelObjective::sample, .step = ThetaStep::plain, .rate = rate, .updates = 1},
      random, {});
  return {descent.trainer.kernel().expression().nodes[0].shape, descent.end};
}

TEST(GpDescent, APlainStepKeepsTheSignOfTheta8OrEnds) {
  const auto slope_of = [](double target) {
    const auto [shape, end] = shape_after(target, 1e-4);
    EXPECT_TRUE(end.empty());
    return (shape - kShape) / -1e-4;
  };
  constexpr double kTowardsZero = 3.0;
  constexpr double kAwayFromZero = -3.0;
  const double towards = slope_of(kTowardsZero);
  const double away = slope_of(kAwayFromZero);
  ASSERT_LT(towards, 0.0);
  ASSERT_GT(away, 0.0);
  const auto [kept, end] = shape_after(kTowardsZero, 1.5 * kShape / towards);
  EXPECT_FALSE(end.empty());
  EXPECT_EQ(kept, kShape);
  constexpr double kRate = 3e-4;
  const auto [moved, no_end] = shape_after(kAwayFromZero, kRate);
  EXPECT_TRUE(no_end.empty());
  EXPECT_NEAR(moved, kShape - kRate * away, 1e-3 * kRate * away);
}

TEST(ParametricGpTrainer, ThePrintedMomentsAreEquations20And21) {
  const Trained t;
  ParametricGpTrainer trainer = t.trainer;
  const auto [mean, variance] = trainer.predict(t.features.row(0));
  const MatrixXd q = covariance(trainer.kernel(), t.points, t.features).col(0);
  const VectorXd m = trainer.mean() + q * (t.target[0] - mean) / variance;
  const MatrixXd s = trainer.covariance() - q * q.transpose() / variance;
  trainer.take_in_as_printed(t.target[0]);
  EXPECT_LT((trainer.mean() - m).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((trainer.covariance() - s).cwiseAbs().maxCoeff(), 1e-12);
  const double again = trainer.predict(t.features.row(0)).mean;
  EXPECT_NEAR(again, q.col(0).dot(trainer.prior().llt().solve(m)), 1e-9);
}

TEST(ParametricGpTrainer, TakesBackNumbersThatHaveNoKernel) {
  Trained t;
  const std::vector<double> before = t.trainer.parameters();
  std::vector<double> bad = before;
  bad[2] = std::nan("");
  EXPECT_FALSE(t.trainer.set_parameters(bad));
  EXPECT_EQ(t.trainer.parameters(), before);
}

TEST(CollapsedBound, IsTitsiasBoundAndHasItsGradient) {
  const Matrix points = random_points(7, 3);
  const Matrix features = random_points(50, 4);
  const std::vector<double> target = targets_of(features);
  for (const std::string& text : {kCombined, std::string("se_ard+linear_ard")}) {
    SCOPED_TRACE(text);
    const Kernel kernel = some_kernel(text);
    CollapsedBound bound(kernel, points, features, target);
    std::vector<double> at = kernel.log_parameters();
    at.push_back(std::log(0.05));
    std::vector<double> gradient(at.size());
    const double value = bound.evaluate(at, gradient);

    const MatrixXd p = covariance(kernel, points, features);
    MatrixXd k = covariance(kernel, points, points);
    k.diagonal().array() += 1e-8 * k.trace() / 7.0;
    const MatrixXd q = p.transpose() * k.llt().solve(p);
    const MatrixXd noise = 0.05 * MatrixXd::Identity(50, 50);
    const MatrixXd full = covariance(kernel, features, features);
    const double expected =
        log_normal(q + noise, vector_of(target)) - (full - q).trace() / (2.0 * 0.05);
    EXPECT_NEAR(value, -expected, 1e-8 * std::abs(expected));
    EXPECT_LT(expected, log_normal(full + noise, vector_of(target)));
    std::vector<double> unused(at.size());
    expect_gradient(
        gradient, at, [&](const auto& x) { return bound.evaluate(x, unused); }, 1.0);
  }
}

}  // namespace
}  // namespace torsio
