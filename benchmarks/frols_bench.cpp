#include <cstddef>
#include <vector>

#include "fit/common/usable_table.hpp"
#include "fit/narx/frols.hpp"
#include "rows.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio::bench {
namespace {

constexpr std::size_t kSamples = 40'000;
constexpr std::size_t kRegressors = 8;  // 165 monomials of degree 3 and less
constexpr std::size_t kTerms = 8;

/// A polynomial of six terms with noise.
Table samples_of_a_polynomial() {
  Random random(23);
  Table samples{Matrix(kSamples, kRegressors), {}};
  for (double& value : samples.features.values) value = random.normal();
  for (std::size_t n = 0; n < kSamples; ++n) {
    const auto x = samples.features.row(n);
    samples.target.push_back(x[0] + 0.3 * x[1] * x[2] - 0.1 * x[3] * x[3] * x[3] + 0.5 * x[4] +
                             0.2 * x[5] * x[6] + 0.05 * x[7] * x[0] * x[2] + 0.1 * random.normal());
  }
  return samples;
}

}  // namespace

Row frols_40k() {
  const Table samples = samples_of_a_polynomial();
  const double seconds = best_seconds(
      [&] { (void)frols(samples.features, samples.target, {.degree = 3, .terms = kTerms}); });
  // Every candidate made and multiplied with y and with each direction but the last, once.
  const auto products = static_cast<double>(kSamples * monomial_count(kRegressors, 3) * kTerms);
  return {.value = seconds * 1e3,
          .unit = "ms",
          .floor = 2.0 * products / multiply_adds_per_second() * 1e3};
}

void write_frols_40k() {
  const Table samples = samples_of_a_polynomial();
  write_doubles("regressors.f64", samples.features.values);
  write_doubles("target.f64", samples.target);
}

}  // namespace torsio::bench
