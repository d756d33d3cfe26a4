// Gaussian processes against scikit-learn.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "fit/gaussian_process/marginal_likelihood.hpp"
#include "golden_file.hpp"
#include "model/gaussian_process/gaussian_process.hpp"
#include "support/example_data.hpp"

namespace torsio {
namespace {

using test::golden;
using test::Json;
using test::matrix;

KernelExpression kernel_of(const Json& each, std::size_t inputs) {
  KernelExpression kernel = parse_kernel(each["kernel"].get<std::string>(), inputs);
  std::size_t leaf = 0;
  for (KernelNode& node : kernel.nodes) {
    if (node.length_scales.empty()) continue;
    const Json& numbers = each["nodes"][leaf++];
    node.amplitude = numbers["amplitude"].get<double>();
    node.length_scales = numbers["length_scales"].get<std::vector<double>>();
    if (!numbers["shape"].is_null()) node.shape = numbers["shape"].get<double>();
  }
  return kernel;
}

TEST(GaussianProcessGolden, AgreesWithScikitLearnForAFixedKernel) {
  const Json document = golden("gaussian_process.json");
  for (const Json& each : document["fixed"]) {
    SCOPED_TRACE(each["kernel"].get<std::string>());
    const Matrix points = matrix(each["points"]);
    const auto target = each["target"].get<std::vector<double>>();
    const Kernel kernel(kernel_of(each, points.columns), points.columns);
    MarginalLikelihood process(kernel, points, target);
    std::vector<double> numbers = kernel.log_parameters();
    const auto noise = each["noise_variance"].get<double>();
    numbers.push_back(std::log(noise));
    const auto likelihood = each["log_likelihood"].get<double>();
    EXPECT_NEAR(-process.fix(numbers), likelihood, 1e-8 * std::abs(likelihood));
    GaussianProcess::Parameters parameters;
    parameters.scaling.inputs.centre.assign(points.columns, 0.0);
    parameters.scaling.inputs.scale.assign(points.columns, 1.0);
    parameters.kernel = kernel.expression();
    parameters.noise_variance = noise;
    parameters.points = points;
    parameters.weights = process.weights();
    GaussianProcess model(parameters);
    const Matrix at = matrix(each["at"]);
    for (std::size_t n = 0; n < at.rows; ++n) {
      const Estimate estimate = model.step(at.row(n));
      EXPECT_NEAR(estimate.value, each["mean"][n].get<double>(), 1e-8);
      EXPECT_NEAR(estimate.std_dev, each["std_dev"][n].get<double>(), 1e-8);
    }
  }
}

TEST(GaussianProcessGolden, FindsAtLeastTheLikelihoodThatScikitLearnFinds) {
  const Json document = golden("gaussian_process.json");
  for (const Json& each : document["optimised"]) {
    SCOPED_TRACE(each["kernel"].get<std::string>());
    const auto target = each["target"].get<std::vector<double>>();
    std::size_t next = 0;
    const TrainingData data =
        test::training_data_of({{.expression = "a"}, {.expression = "b"}}, matrix(each["points"]),
                               [&](Features) { return target[next++]; });
    const auto fitted = fit_gaussian_process(data, {.kernel = each["kernel"].get<std::string>()});
    const GaussianProcess::Parameters& p = fitted.parameters;
    const Kernel kernel(p.kernel, 2);
    MarginalLikelihood process(kernel, p.points, target);
    std::vector<double> numbers = kernel.log_parameters();
    numbers.push_back(std::log(p.noise_variance));
    EXPECT_GE(-process.fix(numbers), each["log_likelihood"].get<double>() - 1e-3);
  }
}

}  // namespace
}  // namespace torsio
