#include "model/gaussian_process/gaussian_process.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "model/gaussian_process/parametric_gp.hpp"
#include "support/each_instruction_set.hpp"
#include "support/error_message.hpp"
#include "support/examples/gaussian_process.hpp"

namespace torsio {
namespace {

using test::error_message;
using test::example;
using testing::HasSubstr;

/// k(a, b) of all rows of two tables.
Eigen::MatrixXd covariance(const KernelExpression& expression, const Matrix& a, const Matrix& b) {
  const Kernel kernel(expression, a.columns);
  const PackedPoints points(b);
  detail::AlignedVector<double> values(points.padded_size());
  Eigen::MatrixXd result(a.rows, b.rows);
  for (std::size_t i = 0; i < a.rows; ++i) {
    kernel.row(a.row(i).data(), points, b.rows, values.data());
    for (std::size_t j = 0; j < b.rows; ++j)
      result(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = values[j];
  }
  return result;
}

Matrix standardised(const NetworkScaling& scaling, Features features) {
  Matrix row(1, features.size());
  for (std::size_t j = 0; j < features.size(); ++j)
    row(0, j) = (features[j] - scaling.inputs.centre[j]) / scaling.inputs.scale[j];
  return row;
}

TEST(GaussianProcess, ReturnsMeanAndSpreadOfItsDefinition) {
  auto model = example<GaussianProcess>();
  const auto& [scaling, expression, noise, points, weights, with_std_dev] = model.parameters();
  Eigen::MatrixXd k = covariance(expression, points, points);
  k.diagonal().array() += noise;
  const Matrix features = test::example_features(50, 2);
  test::on_each_instruction_set([&, &scaling = scaling, &expression = expression, &points = points,
                                 &weights = weights, noise = noise](const char* name) {
    SCOPED_TRACE(name);
    for (std::size_t n = 0; n < features.rows; ++n) {
      const Matrix x = standardised(scaling, features.row(n));
      const Eigen::VectorXd q = covariance(expression, points, x);
      const double mean =
          q.dot(Eigen::Map<const Eigen::VectorXd>(weights.data(), Eigen::Index(weights.size())));
      const double prior = covariance(expression, x, x)(0, 0);
      const double left = prior - q.dot(k.llt().solve(q));
      const Estimate estimate = model.step(features.row(n));
      EXPECT_NEAR(estimate.value, scaling.target_centre + scaling.target_scale * mean, 1e-11);
      EXPECT_NEAR(estimate.std_dev, scaling.target_scale * std::sqrt(left + noise), 1e-9);
      EXPECT_NEAR(estimate.novelty, left / prior, 1e-10);
      EXPECT_EQ(estimate.fault, Fault::none);
    }
  });
}

TEST(GaussianProcess, LeavesTheSpreadOutIfConfiguredSo) {
  auto parameters = example<GaussianProcess>().parameters();
  parameters.with_std_dev = false;
  GaussianProcess plain(parameters);
  auto full = example<GaussianProcess>();
  const std::vector<double> x{0.05, 0.1};
  EXPECT_EQ(plain.step(x).value, full.step(x).value);
  EXPECT_TRUE(std::isnan(plain.step(x).std_dev));
  EXPECT_TRUE(std::isnan(plain.step(x).novelty));
}

TEST(ParametricGp, ReturnsMeanAndSpreadOfItsDefinition) {
  auto model = example<ParametricGp>();
  const ParametricGp::Parameters& p = model.parameters();
  const Matrix features = test::example_features(50, 2);
  for (std::size_t n = 0; n < features.rows; ++n) {
    const Matrix x = standardised(p.scaling, features.row(n));
    const Eigen::VectorXd q = covariance(p.kernel, p.inducing_points, x);
    const double mean =
        q.dot(Eigen::Map<const Eigen::VectorXd>(p.weights.data(), Eigen::Index(p.weights.size())));
    const double prior = covariance(p.kernel, x, x)(0, 0);
    const double left = prior - 0.1 * q.squaredNorm();
    const Estimate estimate = model.step(features.row(n));
    EXPECT_NEAR(estimate.value, p.scaling.target_centre + p.scaling.target_scale * mean, 1e-11);
    EXPECT_NEAR(estimate.std_dev, p.scaling.target_scale * std::sqrt(left + p.noise_variance),
                1e-10);
    EXPECT_NEAR(estimate.novelty, left / prior, 1e-12);
  }
}

template <class Model>
void expect_faults_without_harm(Model model) {
  const std::vector<double> good{0.05, 0.1};
  const double expected = model.step(good).value;
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, -HUGE_VAL}) {
    const Estimate estimate = model.step(std::vector{0.05, bad});
    EXPECT_EQ(estimate.fault, Fault::model_not_finite) << bad;
    EXPECT_EQ(estimate.value, model.parameters().scaling.target_centre);
    EXPECT_TRUE(std::isnan(estimate.std_dev));
    EXPECT_EQ(model.step(good).value, expected);
  }
}

TEST(GaussianProcess, GivesItsCentreAndAFaultForWhatIsNoNumber) {
  expect_faults_without_harm(example<GaussianProcess>());
  expect_faults_without_harm(example<ParametricGp>());
}

TEST(GaussianProcess, RefusesParametersThatMakeNone) {
  const auto complaint = [](const std::function<void(GaussianProcess::Parameters&)>& spoil) {
    auto parameters = example<GaussianProcess>().parameters();
    spoil(parameters);
    return error_message([&] { const GaussianProcess model(parameters); });
  };
  EXPECT_THAT(complaint([](auto& p) { p.weights.pop_back(); }), HasSubstr("weights"));
  EXPECT_THAT(complaint([](auto& p) { p.noise_variance = 0.0; }), HasSubstr("noise_variance"));
  EXPECT_THAT(complaint([](auto& p) { p.points = Matrix(0, 2); }), HasSubstr("1 to 4096 points"));
  EXPECT_THAT(complaint([](auto& p) { p.points = Matrix(4097, 2); }), HasSubstr("found 4097"));
  EXPECT_THAT(complaint([](auto& p) { p.points(3, 1) = HUGE_VAL; }), HasSubstr("index 7"));
  EXPECT_THAT(complaint([](auto& p) { p.scaling.inputs.scale[1] = 0.0; }), HasSubstr("scale[1]"));
  EXPECT_THAT(complaint([](auto& p) { p.points = Matrix(9, 3); }), HasSubstr("9 x 2"));
}

TEST(GaussianProcess, RefusesAKernelThatIsNotPositiveDefinite) {
  auto parameters = example<GaussianProcess>().parameters();
  // (1 - R / 20)^10 rises again for R > 20: far points would be closer than near ones.
  parameters.kernel = parse_kernel("rq", 2);
  parameters.kernel.nodes[0].shape = -10.0;
  parameters.kernel.nodes[0].length_scales = {0.1};
  parameters.noise_variance = 1e-6;
  EXPECT_THAT(error_message([&] { const GaussianProcess model(parameters); }),
              HasSubstr("not positive definite"));
}

TEST(ParametricGp, RefusesPointsOutsideItsKernelsDomain) {
  auto parameters = example<ParametricGp>().parameters();
  parameters.kernel = parse_kernel("rq", 2);
  parameters.kernel.nodes[0].shape = -5.3729;
  EXPECT_NO_THROW(ParametricGp{parameters});
  parameters.inducing_points(8, 0) = 9.0;
  EXPECT_THAT(error_message([&] { const ParametricGp model(parameters); }),
              testing::AllOf(HasSubstr("alpha below 0"), HasSubstr("point 0")));
}

TEST(ParametricGp, FaultsWhereItsKernelIsNot) {
  auto parameters = example<ParametricGp>().parameters();
  parameters.kernel = parse_kernel("rq", 2);
  parameters.kernel.nodes[0].shape = -5.3729;
  ParametricGp model(parameters);
  EXPECT_EQ(model.step(std::vector{0.05, 0.1}).fault, Fault::none);
  EXPECT_EQ(model.step(std::vector{50.0, 0.1}).fault, Fault::model_not_finite);
}

}  // namespace
}  // namespace torsio
