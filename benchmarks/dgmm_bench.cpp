#include "dgmm_bench.hpp"

#include <cmath>
#include <vector>

#include "fit/mixture/mixture_em.hpp"
#include "fit/mixture/online_mixture.hpp"
#include "model/mixture/mixture_regression.hpp"
#include "rows.hpp"
#include "torsio/core/random.hpp"

namespace torsio::bench {

namespace {

constexpr std::size_t kSamples = 216000;
constexpr std::size_t kQueries = 100000;
constexpr std::size_t kFewQueries = 1000;
constexpr std::size_t kInputs = 3;

}  // namespace

// A lever moved back and forth on a spring with friction, with growing amplitude: torque, deflection,
// deflection rate, joint speed. Numbers without unit, all of the order of one.
Matrix spring_samples(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  Matrix samples(count, kInputs + 1);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = 1e-3 * static_cast<double>(i);
    const double phase = 0.3 * t + 0.5 * std::sin(0.011 * t);
    const double swell = 1.0 + 0.9 * std::sin(0.037 * t);
    const double deflection = swell * std::sin(phase) + 0.05 * random.normal();
    const double rate = swell * std::cos(phase) + 0.15 * random.normal();
    const double speed = std::sin(0.05 * t) + 0.3 * deflection + 0.15 * random.normal();
    const double torque = 1.5 * deflection + 0.3 * std::tanh(rate / 0.2) +
                          0.1 * speed * deflection + 0.02 * random.normal();
    samples(i, 0) = torque;
    samples(i, 1) = deflection;
    samples(i, 2) = rate;
    samples(i, 3) = speed;
  }
  return samples;
}

namespace {

// Any number of them is spread over the whole record.
Matrix query_inputs(std::size_t count) {
  const Matrix samples = spring_samples(kSamples, 2);
  Matrix inputs(count, kInputs);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < kInputs; ++j)
      inputs(i, j) = samples(2 * (kQueries / count) * i, j + 1);
  return inputs;
}

GaussianMixture learned(const Matrix& samples, const OnlineMixtureSettings& settings) {
  OnlineMixture learner(robust_standardisation(samples, std::vector<double>(kInputs + 1, 1e-3)),
                        settings);
  for (std::size_t i = 0; i < samples.rows; ++i) learner.learn(samples.row(i));
  return learner.mixture();
}

// More novelties than components: the learner has to merge.
constexpr OnlineMixtureSettings kFull{.components = 5000, .novelty_distance = 0.1};
constexpr OnlineMixtureSettings kHundred{.components = 100, .novelty_distance = 0.3};

constexpr OnlineMixtureSettings kThreeHundred{.components = 300, .novelty_distance = 0.25};

}  // namespace

const GaussianMixture& full_mixture() {
  static const GaussianMixture mixture = learned(spring_samples(kSamples, 1), kFull);
  return mixture;
}

const GaussianMixture& small_mixture() {
  static const GaussianMixture mixture = learned(spring_samples(kSamples, 1), kThreeHundred);
  return mixture;
}

namespace {

double mean_query_bytes(MixtureRegression& regression, const Matrix& inputs) {
  double sum = 0.0;
  for (std::size_t i = 0; i < inputs.rows; ++i) {
    static_cast<void>(regression.query(inputs.row(i)));
    sum += static_cast<double>(regression.bytes_read());
  }
  return sum / static_cast<double>(inputs.rows);
}

struct QueryTimes {
  double query_s;
  double floor_s;
};

QueryTimes time_queries(std::size_t count) {
  MixtureRegression regression(full_mixture(), 0);
  const Matrix inputs = query_inputs(count);
  const double bytes = mean_query_bytes(regression, inputs);
  std::vector<Conditional> results(count);
  const double seconds = best_seconds([&] { regression.query(inputs, results); });
  return {seconds / static_cast<double>(count), stream_seconds(static_cast<std::size_t>(bytes))};
}

}  // namespace

Row dgmm_5000_query() {
  const QueryTimes times = time_queries(kFewQueries);
  return {.value = times.query_s * 1e6, .unit = "us", .floor = times.floor_s * 1e6};
}

Row dgmm_100k_batch() {
  const QueryTimes times = time_queries(kQueries);
  constexpr auto kCount = static_cast<double>(kQueries);
  return {
      .value = times.query_s * kCount * 1e6, .unit = "us", .floor = times.floor_s * kCount * 1e6};
}

Row dgmm_online_216k() {
  const Matrix samples = spring_samples(kSamples, 1);
  const double seconds = best_seconds([&] { static_cast<void>(learned(samples, kFull)); }, 0.0, 3);
  // Each sample is compared with each mean, in float.
  const double search = stream_seconds(kFull.components * (kInputs + 1) * sizeof(float));
  return {
      .value = seconds * 1e6, .unit = "us", .floor = search * static_cast<double>(kSamples) * 1e6};
}

Row em_k100_iteration() {
  const Matrix samples = spring_samples(kSamples, 1);
  const GaussianMixture start = learned(samples, kHundred);
  const MixtureEm em(samples, {start.centre, start.scale}, {.count = 5.0, .spread = 0.15});
  const double seconds = best_seconds([&] {
    GaussianMixture mixture = start;
    static_cast<void>(em.iterate(mixture, 1));
  });
  // The log density of every sample under every component: 4 differences, 10 + 4 multiply-adds.
  const double operations =
      18.0 * static_cast<double>(kSamples) * static_cast<double>(start.size());
  return {
      .value = seconds * 1e6, .unit = "us", .floor = operations / multiply_adds_per_second() * 1e6};
}

void write_query_inputs() {
  const GaussianMixture& mixture = full_mixture();
  write_doubles("weights.f64", mixture.weights);
  write_doubles("means.f64", mixture.means.values);
  write_doubles("covariances.f64", mixture.covariances.values);
  write_doubles("centre.f64", mixture.centre);
  write_doubles("scale.f64", mixture.scale);
  const Matrix inputs = query_inputs(kFewQueries);
  write_doubles("queries.f64", inputs.values);
  MixtureRegression regression(mixture, 0);
  std::vector<double> conditionals;
  for (std::size_t i = 0; i < kFewQueries; ++i) {
    const Conditional answer = regression.query_exact(inputs.row(i));
    conditionals.insert(conditionals.end(), {answer.mean, answer.variance, answer.log_density});
  }
  write_doubles("conditionals.f64", conditionals);
}

void write_em_inputs() {
  const Matrix samples = spring_samples(kSamples, 1);
  const GaussianMixture start = learned(samples, kHundred);
  Matrix standardised = samples;
  for (std::size_t i = 0; i < samples.rows; ++i)
    for (std::size_t j = 0; j < samples.columns; ++j)
      standardised(i, j) = (samples(i, j) - start.centre[j]) / start.scale[j];
  write_doubles("em_samples.f64", standardised.values);
  write_doubles("em_weights.f64", start.weights);
  write_doubles("em_means.f64", start.means.values);
  write_doubles("em_covariances.f64", start.covariances.values);
}

}  // namespace torsio::bench
