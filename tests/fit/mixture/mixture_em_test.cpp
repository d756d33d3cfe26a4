#include "fit/mixture/mixture_em.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "model/mixture/random_mixture.hpp"
#include "support/each_instruction_set.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr MixtureEm::Prior kPrior{.count = 5.0, .spread = 0.1};

// Samples drawn from a mixture, physical units.
Matrix draw(const GaussianMixture& mixture, std::size_t count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::discrete_distribution<std::size_t> pick(mixture.weights.begin(), mixture.weights.end());
  const auto d = static_cast<Eigen::Index>(mixture.dimension());
  Matrix samples(count, mixture.dimension());
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = pick(random);
    const Eigen::MatrixXd root =
        Eigen::Map<const Eigen::MatrixXd>(mixture.covariances.row(i).data(), d, d).llt().matrixL();
    Eigen::VectorXd noise(d);
    for (double& value : noise) value = normal(random);
    const Eigen::VectorXd offset = root * noise;
    for (std::size_t j = 0; j < mixture.dimension(); ++j)
      samples(k, j) = mixture.centre[j] + mixture.scale[j] * (mixture.means(i, j) +
                                                              offset(static_cast<Eigen::Index>(j)));
  }
  return samples;
}

// One iteration written straight from the equations.
double plain_iteration(GaussianMixture& mixture, const Matrix& samples) {
  const std::size_t m = mixture.size();
  const auto d = static_cast<Eigen::Index>(mixture.dimension());
  std::vector<Eigen::VectorXd> x;
  for (std::size_t k = 0; k < samples.rows; ++k) {
    x.emplace_back(d);
    for (Eigen::Index j = 0; j < d; ++j) {
      const auto q = static_cast<std::size_t>(j);
      x.back()(j) = (samples(k, q) - mixture.centre[q]) / mixture.scale[q];
    }
  }
  const auto mean_of = [&](std::size_t i) {
    return Eigen::Map<Eigen::VectorXd>(mixture.means.row(i).data(), d);
  };
  const auto covariance_of = [&](std::size_t i) {
    return Eigen::Map<Eigen::MatrixXd>(mixture.covariances.row(i).data(), d, d);
  };
  Eigen::MatrixXd density(static_cast<Eigen::Index>(samples.rows), static_cast<Eigen::Index>(m));
  for (std::size_t i = 0; i < m; ++i) {
    const Eigen::MatrixXd inverse = covariance_of(i).inverse();
    const double factor =
        mixture.weights[i] /
        std::sqrt((2.0 * std::numbers::pi * covariance_of(i)).eval().determinant());
    for (std::size_t k = 0; k < x.size(); ++k) {
      const Eigen::VectorXd centred = x[k] - mean_of(i);
      density(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) =
          factor * std::exp(-0.5 * centred.dot(inverse * centred));
    }
  }
  const Eigen::VectorXd total = density.rowwise().sum();
  for (std::size_t i = 0; i < m; ++i) {
    const Eigen::VectorXd share = density.col(static_cast<Eigen::Index>(i)).cwiseQuotient(total);
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(d);
    for (std::size_t k = 0; k < x.size(); ++k) mean += share(static_cast<Eigen::Index>(k)) * x[k];
    mean /= share.sum();
    Eigen::MatrixXd scatter =
        kPrior.count * kPrior.spread * kPrior.spread * Eigen::MatrixXd::Identity(d, d);
    for (std::size_t k = 0; k < x.size(); ++k)
      scatter += share(static_cast<Eigen::Index>(k)) * (x[k] - mean) * (x[k] - mean).transpose();
    mixture.weights[i] = share.sum() / static_cast<double>(samples.rows);
    mean_of(i) = mean;
    covariance_of(i) = scatter / (kPrior.count + share.sum());
  }
  return total.array().log().mean();
}

class EmDimension : public ::testing::TestWithParam<std::size_t> {};

TEST_P(EmDimension, AnIterationEqualsTheEquations) {
  GaussianMixture mixture = test::random_mixture(
      {.components = 6, .dimension = GetParam(), .narrowest = 0.3, .widest = 0.8}, 4);
  const Matrix samples = draw(mixture, 1001, 5);  // not a whole number of tiles
  const MixtureEm em(samples, {mixture.centre, mixture.scale}, kPrior);
  GaussianMixture expected = mixture;
  for (int k = 0; k < 3; ++k) {
    const double expected_likelihood = plain_iteration(expected, samples);
    EXPECT_NEAR(em.iterate(mixture), expected_likelihood, 1e-10);
  }
  for (std::size_t i = 0; i < mixture.size(); ++i)
    EXPECT_NEAR(mixture.weights[i], expected.weights[i], 1e-10);
  for (std::size_t i = 0; i < mixture.means.values.size(); ++i)
    EXPECT_NEAR(mixture.means.values[i], expected.means.values[i], 1e-9);
  for (std::size_t i = 0; i < mixture.covariances.values.size(); ++i)
    EXPECT_NEAR(mixture.covariances.values[i], expected.covariances.values[i], 1e-9);
}
INSTANTIATE_TEST_SUITE_P(MixtureEm, EmDimension, ::testing::Values(1, 2, 3, 4, 5, 7));

TEST(MixtureEm, AgreesOnEveryInstructionSet) {
  const GaussianMixture start = test::random_mixture({.components = 10}, 4);
  const Matrix samples = draw(start, 3000, 5);
  const MixtureEm em(samples, {start.centre, start.scale}, kPrior);
  std::vector<double> likelihoods;
  test::on_each_instruction_set([&](const char*) {
    GaussianMixture mixture = start;
    static_cast<void>(em.iterate(mixture));
    likelihoods.push_back(em.iterate(mixture));
  });
  ASSERT_GE(likelihoods.size(), 2U);
  for (const double likelihood : likelihoods) EXPECT_NEAR(likelihood, likelihoods.front(), 1e-10);
}

TEST(MixtureEm, ClimbsTheLikelihoodFromAPoorStart) {
  const GaussianMixture truth = test::random_mixture({.components = 5, .dimension = 2}, 12);
  const Matrix samples = draw(truth, 4000, 13);
  const MixtureEm em(samples, {truth.centre, truth.scale}, {.count = 1e-3, .spread = 0.1});
  GaussianMixture mixture = test::random_mixture({.components = 5, .dimension = 2}, 14);
  mixture.centre = truth.centre;
  mixture.scale = truth.scale;
  double last = em.iterate(mixture);
  const double start = last;
  for (int k = 0; k < 30; ++k) {
    const double now = em.iterate(mixture);
    EXPECT_GE(now, last - 1e-6);
    last = now;
  }
  EXPECT_GT(last, start + 1.0);
}

TEST(MixtureEm, DoesNotDependOnTheNumberOfThreads) {
  const GaussianMixture truth = test::random_mixture({.components = 20}, 2);
  const Matrix samples = draw(truth, 20000, 3);
  const MixtureEm em(samples, {truth.centre, truth.scale}, kPrior);
  GaussianMixture one = truth;
  GaussianMixture three = truth;
  for (int k = 0; k < 2; ++k) EXPECT_EQ(em.iterate(one, 1), em.iterate(three, 3));
  EXPECT_EQ(one, three);
}

TEST(MixtureEm, RemovesComponentsThatNoSampleBelongsTo) {
  GaussianMixture mixture = test::random_mixture({.components = 4, .dimension = 2}, 2);
  const Matrix samples = draw(mixture, 500, 3);
  mixture.means(2, 0) = 1e3;
  const MixtureEm em(samples, {mixture.centre, mixture.scale}, kPrior);
  em.iterate(mixture);
  EXPECT_EQ(mixture.size(), 3U);
  EXPECT_NO_THROW(check(mixture));
}

TEST(MixtureEm, RefusesWhatDoesNotFitTogether) {
  const GaussianMixture mixture = test::random_mixture({.dimension = 2}, 2);
  const Standardisation by{mixture.centre, mixture.scale};
  EXPECT_THROW(MixtureEm(Matrix(10, 3), by, kPrior), Error);
  EXPECT_THROW(MixtureEm(Matrix(0, 2), by, kPrior), Error);
  EXPECT_THROW(MixtureEm(Matrix(10, 2), by, {.count = 0.0, .spread = 1.0}), Error);
  GaussianMixture other = test::random_mixture({.dimension = 3}, 2);
  EXPECT_THROW(MixtureEm(Matrix(10, 2), by, kPrior).iterate(other), Error);
}

}  // namespace
}  // namespace torsio
