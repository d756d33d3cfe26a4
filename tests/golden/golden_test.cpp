// Our numbers against those of numpy and scipy (make_oracles.py).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <string>
#include <vector>

#include "fit/linear/fit_linear.hpp"
#include "golden_file.hpp"
#include "model/common/schedule.hpp"
#include "model/mixture/mixture_regression.hpp"
#include "support/example_data.hpp"
#include "torsio/signal/lowpass.hpp"

namespace torsio {
namespace {

using test::golden;
using test::Json;
using test::matrix;

std::vector<double> numbers(const Json& array) { return array.get<std::vector<double>>(); }

// The response to `count` samples of a signal after a 0 (which starts the filter at rest).
template <class Signal>
std::vector<double> response(const Json& filter_case, std::size_t count, Signal signal) {
  Lowpass filter(filter_case["cutoff_Hz"], filter_case["sample_rate_Hz"]);
  (void)filter.step(0.0);
  std::vector<double> all;
  for (std::size_t n = 0; n < count; ++n) all.push_back(filter.step(signal(n)));
  return all;
}

double gain(const std::vector<double>& impulse_response, double cycles_per_sample) {
  std::complex<double> sum = 0.0;
  for (std::size_t n = 0; n < impulse_response.size(); ++n)
    sum += std::polar(impulse_response[n],
                      -2.0 * std::numbers::pi * cycles_per_sample * static_cast<double>(n));
  return std::abs(sum);
}

TEST(Golden, ALowpassHasTheFrequencyResponseOfScipyAtEveryRate) {
  for (const Json& each : golden("lowpass.json")) {
    SCOPED_TRACE(each["sample_rate_Hz"].dump());
    const auto impulse = response(each, 40'000, [](std::size_t n) { return n == 0 ? 1.0 : 0.0; });
    for (std::size_t i = 0; i < each["gains"].size(); ++i) {
      const double cycles_per_sample =
          each["frequencies_Hz"][i].get<double>() / each["sample_rate_Hz"].get<double>();
      EXPECT_NEAR(gain(impulse, cycles_per_sample), each["gains"][i].get<double>(), 1e-10);
    }
  }
}

TEST(Golden, ALowpassFollowsAStepAsScipyDoes) {
  for (const Json& each : golden("lowpass.json")) {
    SCOPED_TRACE(each["sample_rate_Hz"].dump());
    const auto expected = numbers(each["step"]);
    const auto found = response(each, expected.size(), [](std::size_t) { return 1.0; });
    for (std::size_t n = 0; n < expected.size(); ++n)
      EXPECT_NEAR(found[n], expected[n], 1e-11) << "sample " << n;
  }
}

TEST(Golden, AMixtureIsConditionedAsByNumpy) {
  const Json document = golden("mixture.json");
  const Json& parts = document["mixture"];
  const GaussianMixture mixture{.centre = numbers(parts["centre"]),
                                .scale = numbers(parts["scale"]),
                                .weights = numbers(parts["weights"]),
                                .means = matrix(parts["means"]),
                                .covariances = matrix(parts["covariances"])};
  for (const Json& query : document["queries"]) {
    const auto output = query["output"].get<std::size_t>();
    SCOPED_TRACE(query.dump());
    MixtureRegression regression(mixture, output);
    const double unit = mixture.scale[output];
    const double mean = query["mean"].get<double>();
    const double variance = query["variance"].get<double>();
    const double log_density = query["log_density"].get<double>();
    const auto expect = [&](const Conditional& found, double tolerance) {
      EXPECT_NEAR(found.mean, mean, tolerance * unit);
      EXPECT_NEAR(std::sqrt(found.variance), std::sqrt(variance), tolerance * unit);
      EXPECT_NEAR(found.log_density, log_density, tolerance);
    };
    expect(regression.query_exact(numbers(query["inputs"])), 1e-10);
    expect(regression.query(numbers(query["inputs"])), 1e-4);
  }
}

TEST(Golden, AScheduleInterpolatesAsPchipDoes) {
  for (const Json& each : golden("pchip.json")) {
    CoefficientSchedule schedule{.scheduled = true, .knots = numbers(each["knots"])};
    schedule.values = Matrix(schedule.knots.size(), 1);
    schedule.values.values = numbers(each["values"]);
    const ScheduledCoefficients coefficients(schedule, 1, "golden");
    const auto at = numbers(each["at"]);
    const auto expected = numbers(each["expected"]);
    for (std::size_t i = 0; i < at.size(); ++i) {
      double found = 0.0;
      coefficients.evaluate({&at[i], 1}, {&found, 1});
      EXPECT_NEAR(found, expected[i], 1e-10) << at.size() << " knots, at " << at[i];
    }
  }
}

TEST(Golden, ALinearFitIsTheLeastSquaresOfNumpy) {
  const Json document = golden("least_squares.json");
  const auto target = numbers(document["target"]);
  std::size_t next = 0;
  const TrainingData data = test::training_data_of(
      {{.expression = "a"}, {.expression = "b"}, {.expression = "c"}}, matrix(document["features"]),
      [&](std::span<const double>) { return target[next++]; });
  const auto found = fit_linear(data, {}).parameters.coefficients.values.values;
  const auto expected = numbers(document["coefficients"]);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_NEAR(found[i], expected[i], 1e-10 * std::max(1.0, std::abs(expected[i])));
}

}  // namespace
}  // namespace torsio
