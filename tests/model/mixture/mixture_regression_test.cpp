#include "model/mixture/mixture_regression.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "model/mixture/random_mixture.hpp"
#include "support/each_instruction_set.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using test::MixtureShape;
using test::random_mixture;

// ln of the joint density of one component, times its weight, straight from the definition.
double joint_log_term(const GaussianMixture& mixture, std::size_t i, const std::vector<double>& x) {
  const auto d = static_cast<Eigen::Index>(mixture.dimension());
  Eigen::VectorXd centred(d);
  for (Eigen::Index j = 0; j < d; ++j) {
    const auto k = static_cast<std::size_t>(j);
    centred(j) = (x[k] - mixture.centre[k]) / mixture.scale[k] - mixture.means(i, k);
  }
  const Eigen::MatrixXd covariance =
      Eigen::Map<const Eigen::MatrixXd>(mixture.covariances.row(i).data(), d, d);
  return std::log(mixture.weights[i]) - 0.5 * centred.dot(covariance.fullPivLu().solve(centred)) -
         0.5 * std::log(covariance.determinant()) -
         0.5 * static_cast<double>(d) * std::log(2.0 * std::numbers::pi);
}

// Mean, variance and input density of quantity `output` by integrating the joint density over it.
Conditional by_quadrature(const GaussianMixture& mixture, std::size_t output,
                          const std::vector<double>& inputs) {
  std::vector<double> x = inputs;
  x.insert(x.begin() + static_cast<std::ptrdiff_t>(output), 0.0);
  constexpr int kPoints = 40001;
  constexpr double kReach = 14.0;
  const double step = 2.0 * kReach / (kPoints - 1);
  double total = 0.0;
  double first = 0.0;
  double second = 0.0;
  for (int k = 0; k < kPoints; ++k) {
    const double y = -kReach + step * k;  // standardised
    x[output] = mixture.centre[output] + mixture.scale[output] * y;
    double density = 0.0;
    for (std::size_t i = 0; i < mixture.size(); ++i)
      density += std::exp(joint_log_term(mixture, i, x));
    total += density;
    first += density * y;
    second += density * y * y;
  }
  const double mean = first / total;
  const double scale = mixture.scale[output];
  return {mixture.centre[output] + scale * mean, scale * scale * (second / total - mean * mean),
          std::log(total * step)};
}

std::vector<double> random_inputs(const GaussianMixture& mixture, std::size_t output,
                                  std::mt19937_64& random, double reach = 1.0) {
  std::normal_distribution<double> normal;
  std::vector<double> inputs;
  for (std::size_t j = 0; j < mixture.dimension(); ++j)
    if (j != output)
      inputs.push_back(mixture.centre[j] + mixture.scale[j] * reach * normal(random));
  return inputs;
}

TEST(MixtureRegression, EqualsNumericalQuadratureInEveryDirection) {
  const GaussianMixture mixture =
      random_mixture({.components = 3, .dimension = 3, .narrowest = 0.4, .widest = 0.9}, 7);
  std::mt19937_64 random(11);
  for (std::size_t output = 0; output < 3; ++output) {
    MixtureRegression regression(mixture, output);
    const std::vector<double> inputs = random_inputs(mixture, output, random);
    const Conditional expected = by_quadrature(mixture, output, inputs);
    for (const Conditional& found : {regression.query_exact(inputs), regression.query(inputs)}) {
      EXPECT_NEAR(found.mean, expected.mean, 1e-12) << "output " << output;
      EXPECT_NEAR(found.variance, expected.variance, 1e-12) << "output " << output;
      EXPECT_NEAR(found.log_density, expected.log_density, 1e-12) << "output " << output;
    }
  }
}

struct FastPathCase {
  const char* name;
  MixtureShape shape;
  double reach;
};

class FastPath : public ::testing::TestWithParam<FastPathCase> {};

TEST_P(FastPath, AgreesWithTheExactPath) {
  const auto& [name, shape, reach] = GetParam();
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(::testing::Message() << name << ", seed " << seed);
    const GaussianMixture mixture = random_mixture(shape, seed);
    std::mt19937_64 random(100 + seed);
    MixtureRegression regression(mixture, 0);
    const double unit = mixture.scale[0];
    for (int k = 0; k < 100; ++k) {
      const std::vector<double> inputs = random_inputs(mixture, 0, random, reach);
      const Conditional exact = regression.query_exact(inputs);
      const Conditional fast = regression.query(inputs);
      ASSERT_TRUE(std::isfinite(exact.mean));
      ASSERT_NEAR(fast.mean, exact.mean, 1e-4 * unit * std::max(1.0, std::abs(exact.mean) * 1e-6));
      ASSERT_NEAR(std::sqrt(fast.variance), std::sqrt(exact.variance), 1e-4 * unit);
      ASSERT_NEAR(fast.log_density, exact.log_density,
                  1e-4 * std::max(1.0, std::abs(exact.log_density) * 1e-6));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    MixtureRegression, FastPath,
    ::testing::Values(
        FastPathCase{"one component", {.components = 1}, 1.0},
        FastPathCase{"few components", {.components = 7}, 1.0},
        FastPathCase{"broad", {.components = 300, .narrowest = 0.5, .widest = 1.5}, 1.0},
        FastPathCase{"all overlapping", {.components = 2000, .narrowest = 0.9, .widest = 1.1}, 1.0},
        FastPathCase{
            "overlapping and narrow", {.components = 2000, .narrowest = 1e-4, .widest = 3.0}, 1.0},
        FastPathCase{"overlapping in seven",
                     {.components = 500, .dimension = 8, .narrowest = 0.5, .widest = 1.5},
                     1.0},
        FastPathCase{"one input", {.components = 100, .dimension = 2}, 1.0},
        FastPathCase{"two inputs", {.components = 100, .dimension = 3}, 1.0},
        FastPathCase{"four inputs", {.components = 100, .dimension = 5}, 1.0},
        FastPathCase{"seven inputs", {.components = 100, .dimension = 8}, 1.0},
        FastPathCase{"narrow", {.components = 400, .narrowest = 1e-5, .widest = 0.3}, 1.0},
        FastPathCase{"narrow with background",
                     {.components = 400, .narrowest = 1e-5, .widest = 0.1, .background = true},
                     1.0},
        FastPathCase{"far", {.components = 200}, 50.0},
        FastPathCase{"narrow and very far", {.components = 200, .narrowest = 1e-3}, 1e5}),
    [](const auto& test_case) {
      std::string name = test_case.param.name;
      std::replace(name.begin(), name.end(), ' ', '_');
      return name;
    });

TEST(MixtureRegression, AgreesWithTheExactPathOnEveryInstructionSet) {
  int sets = 0;
  test::on_each_instruction_set([&](const char* name) {
    SCOPED_TRACE(name);
    ++sets;
    for (const double spread : {0.1, 1.0}) {  // finished in double and in float32
      const GaussianMixture mixture = random_mixture(
          {.components = 1000, .narrowest = spread, .widest = spread, .background = true}, 8);
      MixtureRegression regression(mixture, 0);
      std::mt19937_64 random(9);
      for (int k = 0; k < 50; ++k) {
        const std::vector<double> inputs = random_inputs(mixture, 0, random);
        const Conditional exact = regression.query_exact(inputs);
        const Conditional fast = regression.query(inputs);
        ASSERT_NEAR(fast.mean, exact.mean, 1e-4 * mixture.scale[0]);
        ASSERT_NEAR(std::sqrt(fast.variance), std::sqrt(exact.variance), 1e-4 * mixture.scale[0]);
        ASSERT_NEAR(fast.log_density, exact.log_density, 1e-4);
      }
    }
  });
  EXPECT_GE(sets, test::kFewestInstructionSets);
}

TEST(MixtureRegression, DoesNotDependOnTheOrderOfComponents) {
  const GaussianMixture mixture = random_mixture({.components = 60}, 15);
  GaussianMixture turned = mixture;
  for (std::size_t i = 0; i < mixture.size(); ++i) {
    const std::size_t from = mixture.size() - 1 - i;
    turned.weights[i] = mixture.weights[from];
    std::ranges::copy(mixture.means.row(from), turned.means.row(i).begin());
    std::ranges::copy(mixture.covariances.row(from), turned.covariances.row(i).begin());
  }
  MixtureRegression one(mixture, 0);
  MixtureRegression other(turned, 0);
  std::mt19937_64 random(16);
  for (int k = 0; k < 50; ++k) {
    const std::vector<double> inputs = random_inputs(mixture, 0, random);
    const double mean = one.query(inputs).mean;
    EXPECT_NEAR(other.query(inputs).mean, mean, 1e-9 * std::max(1.0, std::abs(mean)));
  }
}

TEST(MixtureRegression, FindsANarrowComponentThatFloatCannotPlace) {
  // Two components a hundred times closer to each other than the resolution of float32 at their
  // position.
  GaussianMixture mixture{.centre = {0.0, 0.0},
                          .scale = {1.0, 1.0},
                          .weights = {0.5, 0.5},
                          .means = Matrix(2, 2),
                          .covariances = Matrix(2, 4)};
  mixture.means.values = {-1.0, 3.0 - 1e-9, 1.0, 3.0 + 1e-9};
  mixture.covariances.values = {0.01, 0.0, 0.0, 1e-20, 0.01, 0.0, 0.0, 1e-20};
  MixtureRegression regression(mixture, 0);
  EXPECT_NEAR(regression.query(std::vector{3.0 - 1e-9}).mean, -1.0, 1e-9);
  EXPECT_NEAR(regression.query(std::vector{3.0 + 1e-9}).mean, 1.0, 1e-9);
}

// Strays of no weight far from all other outputs. Moments in float32 about a stray's would have no
// digits left for the variance; every slot is a stray's once.
TEST(MixtureRegression, KeepsTheVarianceWhereANeighbourOfNoWeightIsFarOff) {
  constexpr std::size_t kComponents = 1024;
  constexpr std::size_t kShare = 8;
  for (std::size_t stray = 0; stray < kShare; ++stray) {
    GaussianMixture mixture{.centre = {0.0, 0.0},
                            .scale = {1.0, 1.0},
                            .weights = std::vector<double>(kComponents),
                            .means = Matrix(kComponents, 2),
                            .covariances = Matrix(kComponents, 4)};
    for (std::size_t i = 0; i < kComponents; ++i) {
      const bool is_stray = i % kShare == stray;
      mixture.weights[i] = (is_stray ? 1e-9 : 1.0) / (kComponents - kComponents / kShare);
      mixture.means(i, 0) = is_stray ? 30.0 : 0.0;
      mixture.covariances(i, 0) = 1e-6;
      mixture.covariances(i, 3) = 1.0;
    }
    MixtureRegression regression(mixture, 0);
    const Conditional exact = regression.query_exact(std::vector{0.1});
    const Conditional fast = regression.query(std::vector{0.1});
    EXPECT_NEAR(fast.mean, exact.mean, 1e-6);
    EXPECT_NEAR(std::sqrt(fast.variance), std::sqrt(exact.variance), 1e-5) << "stray " << stray;
  }
}

TEST(MixtureRegression, DetectsTheInstructionSetsWhenConstructed) {
  if ((HWY_TARGETS & (HWY_TARGETS - 1)) == 0)
    GTEST_SKIP() << "compiled for a single instruction set: there is nothing to ask for";
  hwy::GetChosenTarget().DeInit();
  const MixtureRegression regression(random_mixture({}, 3), 0);
  EXPECT_TRUE(hwy::GetChosenTarget().IsInitialized());
}

TEST(MixtureRegression, ReturnsNaNWhereNoDensityIsLeft) {
  MixtureRegression regression(random_mixture({}, 3), 0);
  for (const double value : {1e200, -1e300, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(regression.query(std::vector{value, 0.0, 0.0}).mean)) << value;
    EXPECT_TRUE(std::isnan(regression.query_exact(std::vector{value, 0.0, 0.0}).mean)) << value;
  }
}

TEST(MixtureRegression, ABatchEqualsSingleQueriesToTheBit) {
  const GaussianMixture mixture = random_mixture({.components = 333, .background = true}, 5);
  std::mt19937_64 random(6);
  Matrix inputs(200, 3);
  for (std::size_t i = 0; i < inputs.rows; ++i) {
    const std::vector<double> row = random_inputs(mixture, 0, random);
    std::copy(row.begin(), row.end(), inputs.row(i).begin());
  }
  MixtureRegression regression(mixture, 0);
  std::vector<Conditional> batch(inputs.rows);
  regression.query(inputs, batch);
  for (std::size_t i = 0; i < inputs.rows; ++i) {
    const Conditional single = regression.query(inputs.row(i));
    EXPECT_EQ(batch[i].mean, single.mean);
    EXPECT_EQ(batch[i].variance, single.variance);
    EXPECT_EQ(batch[i].log_density, single.log_density);
  }
}

TEST(MixtureRegression, RefusesAnOutputThatTheMixtureLacks) {
  EXPECT_THROW(MixtureRegression(random_mixture({}, 1), 4), Error);
  EXPECT_THROW(MixtureRegression(random_mixture({.dimension = 1}, 1), 0), Error);
}

}  // namespace
}  // namespace torsio
