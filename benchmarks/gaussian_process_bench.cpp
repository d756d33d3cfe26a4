#include <cmath>
#include <string>
#include <vector>

#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/gaussian_process/kernel_search.hpp"
#include "fit/gaussian_process/likelihood_search.hpp"
#include "fit/gaussian_process/marginal_likelihood.hpp"
#include "fit/gaussian_process/parametric_gp_trainer.hpp"
#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "rows.hpp"
#include "torsio/core/random.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kInputs = 3;
constexpr std::size_t kRegressors = 15;  // as in paper 002
constexpr std::size_t kClusters = 14;

using Samples = Table;  ///< already standardised

/// A smooth function with noise, everything of about unit size.
Samples samples_of(std::size_t count, std::size_t inputs) {
  Random random(17);
  Samples samples{Matrix(count, inputs), {}};
  for (std::size_t n = 0; n < count; ++n) {
    double sum = 0.0;
    for (std::size_t j = 0; j < inputs; ++j) {
      samples.features(n, j) = random.normal();
      sum += samples.features(n, j) / static_cast<double>(j + 1);
    }
    samples.target.push_back(std::sin(sum) + 0.1 * random.normal());
  }
  return samples;
}

Kernel kernel_of(const char* text, std::size_t inputs) {
  return {parse_kernel(text, inputs), inputs};
}

MarginalLikelihood process_of(const Samples& samples) {
  return {kernel_of("se", kInputs), samples.features, samples.target};
}

/// As in the fit: from one start, on a part of the samples first.
double best_likelihood(const Samples& samples) {
  MarginalLikelihood process = process_of(samples);
  Random random(1);
  return process.fix(
      likeliest_numbers(process, samples, {.restarts = 0, .iterations = 100}, random, {}));
}

void write_samples(const Samples& samples) {
  write_doubles("points.f64", samples.features.values);
  write_doubles("target.f64", samples.target);
}

}  // namespace

Row gp_fit_5000() {
  const Samples samples = samples_of(5000, kInputs);
  MarginalLikelihood process = process_of(samples);
  const std::vector<double> numbers = first_start(process.kernel());
  // N^3 / 6 multiply-adds of the factor
  const double floor = std::pow(5000.0, 3) / 6.0 / multiply_adds_per_second();
  return {.value = best_seconds([&] { (void)process.fix(numbers); }, 2.0, 3),
          .unit = "s",
          .floor = floor};
}

Row gp_mean_5000() {
  const Samples samples = samples_of(5000, kInputs);
  GaussianProcess::Parameters parameters;
  parameters.scaling = no_scaling(kInputs);
  parameters.kernel = parse_kernel("se", kInputs);
  parameters.noise_variance = 0.01;
  parameters.points = samples.features;
  parameters.weights = samples.target;
  parameters.with_std_dev = false;
  GaussianProcess model(parameters);
  const Samples at = samples_of(100, kInputs);
  volatile double sink = 0.0;
  const double seconds = best_seconds([&] {
    for (std::size_t n = 0; n < at.features.rows; ++n) sink = model.step(at.features.row(n)).value;
  });
  return {.value = seconds / static_cast<double>(at.features.rows) * 1e6,
          .unit = "us",
          .floor = stream_seconds(5000 * (kInputs + 1) * sizeof(double)) * 1e6};
}

Row gp_hyper_2000() {
  const Samples samples = samples_of(2000, kInputs);
  const double seconds = best_seconds([&] { (void)best_likelihood(samples); }, 1.0, 2);
  return {.value = seconds, .unit = "s"};
}

Row pgpr_200k() {
  constexpr std::size_t kUpdates = 200'000;
  const Samples samples = samples_of(20'000, kRegressors);
  Random random(3);
  const Matrix centres = cluster_centres(samples.features, kClusters, random);
  KernelExpression expression = parse_kernel("se*(linear+periodic*rq)", kRegressors);
  set_start(expression, median_distance(centres, random));
  const double seconds = best_seconds(
      [&] {
        ParametricGpTrainer trainer(Kernel(expression, kRegressors), centres, 0.1);
        std::vector<double> numbers = trainer.parameters();
        std::vector<double> gradient(numbers.size());
        for (std::size_t update = 0; update < kUpdates; ++update) {
          const std::size_t n = update % samples.target.size();
          (void)trainer.predict(samples.features.row(n));
          trainer.add_data_gradient(samples.target[n], 1.0);
          trainer.add_noise_gradient(samples.target[n], 1.0);
          trainer.take_in(samples.target[n]);
          trainer.add_divergence_gradient(1.0 / static_cast<double>(samples.target.size()));
          trainer.take_gradient(gradient);
          for (std::size_t p = 0; p < numbers.size(); ++p) numbers[p] -= 1e-7 * gradient[p];
          (void)trainer.set_parameters(numbers);
        }
      },
      0.1, 1);
  return {.value = seconds, .unit = "s"};
}

Row pgpr_step() {
  constexpr std::size_t kTimed =
      20;  // in one run: short enough to be undisturbed on a loaded machine
  const Samples points = samples_of(kClusters, kRegressors);
  ParametricGp::Parameters parameters;
  parameters.scaling = no_scaling(kRegressors);
  parameters.kernel = parse_kernel("se*(linear+periodic*rq)", kRegressors);
  parameters.noise_variance = 0.01;
  parameters.inducing_points = points.features;
  parameters.weights = points.target;
  parameters.explained = Matrix(kClusters, kClusters, 0.001);
  ParametricGp model(parameters);
  const Samples at = samples_of(kTimed, kRegressors);
  volatile double sink = 0.0;
  const double seconds = best_seconds(
      [&] {
        for (std::size_t n = 0; n < kTimed; ++n) sink = model.step(at.features.row(n)).value;
      },
      1.0);
  return {.value = seconds / kTimed * 1e6, .unit = "us"};
}

void write_gp_5000() { write_samples(samples_of(5000, kInputs)); }

void write_gp_2000() {
  const Samples samples = samples_of(2000, kInputs);
  write_samples(samples);
  write_doubles("answer.f64", {best_likelihood(samples)});
}

}  // namespace torsio::bench
