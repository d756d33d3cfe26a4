#include "numerics/event_bounds.hpp"

#include <cmath>

namespace torsio {
namespace {

constexpr double kTail = 0.05;
constexpr int kBisections = 100;

/// The root of a function that falls from above `kTail` at `low` to below it at `high`.
template <class Function>
double root(double low, double high, const Function& probability) {
  for (int i = 0; i < kBisections; ++i) {
    const double middle = 0.5 * (low + high);
    (probability(middle) > kTail ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double poisson_at_most(std::size_t events, double mean) {
  double sum = 0.0;
  for (std::size_t k = 0; k <= events; ++k) {
    const auto count = static_cast<double>(k);
    sum += std::exp(count * std::log(mean) - mean - std::lgamma(count + 1.0));
  }
  return sum;
}

double binomial_at_most(std::size_t events, std::size_t trials, double p) {
  const auto n = static_cast<double>(trials);
  double sum = 0.0;
  for (std::size_t k = 0; k <= events; ++k) {
    const auto count = static_cast<double>(k);
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(count + 1.0) - std::lgamma(n - count + 1.0) +
                    count * std::log(p) + (n - count) * std::log1p(-p));
  }
  return sum;
}

}  // namespace

double poisson_upper_95(std::size_t events) {
  const auto count = static_cast<double>(events);
  return root(0.0, count + 10.0 + 5.0 * std::sqrt(count),
              [&](double mean) { return poisson_at_most(events, mean); });
}

double binomial_upper_95(std::size_t events, std::size_t trials) {
  if (events >= trials) return 1.0;
  return root(0.0, 1.0, [&](double p) { return binomial_at_most(events, trials, p); });
}

}  // namespace torsio
