#include "evaluate/monitor/exceedance.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>

#include "numerics/quantile.hpp"
#include "safety/pair_difference.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::size_t kLeastForShape = 30;
constexpr double kLeastShape = -0.4;
constexpr double kLargestShape = 0.0;

}  // namespace

std::vector<double> persisting(std::span<const double> values, std::size_t count) {
  std::vector<double> result(values.size(), kNotMeasured);
  std::deque<double> last;      // in the order of time
  std::vector<double> ordered;  // the same, descending
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (std::isnan(values[n])) continue;
    if (last.size() == detail::kPersistenceWindow * count) {
      ordered.erase(std::ranges::lower_bound(ordered, last.front(), std::ranges::greater()));
      last.pop_front();
    }
    last.push_back(values[n]);
    ordered.insert(std::ranges::lower_bound(ordered, values[n], std::ranges::greater()), values[n]);
    if (ordered.size() >= count) result[n] = ordered[count - 1];
  }
  return result;
}

void BlockMaxima::add(std::span<const double> values) {
  for (const double value : values) add(value);
}

void BlockMaxima::add(double value) {
  if (value > maximum_) maximum_ = value;
  if (++in_block_ < block_) return;
  if (std::isfinite(maximum_)) {
    maxima_.push_back(maximum_);
    largest_ = std::max(largest_, maximum_);
  }
  maximum_ = -std::numeric_limits<double>::infinity();
  in_block_ = 0;
}

double BlockMaxima::threshold(double share) const {
  return maxima_.empty() ? 0.0 : std::max(1.05 * largest_, exceeded_in(share));
}

double BlockMaxima::exceeded_in(double share) const {
  if (maxima_.empty()) return 0.0;
  const double high = quantile(maxima_, 0.9);
  double sum = 0.0;
  double squares = 0.0;
  std::size_t above = 0;
  for (const double maximum : maxima_) {
    if (!(maximum > high)) continue;
    sum += maximum - high;
    squares += (maximum - high) * (maximum - high);
    ++above;
  }
  if (above == 0) return largest_;
  const auto count = static_cast<double>(above);
  const double mean = sum / count;
  const double variance = squares / count - mean * mean;
  const double ratio = count / (share * static_cast<double>(maxima_.size()));
  if (!(ratio > 1.0)) return largest_;
  // Moments of the generalised Pareto distribution (Hosking and Wallis 1987).
  const bool has_shape = above >= kLeastForShape && variance > 0.0;
  const double shape =
      has_shape ? std::clamp(0.5 * (1.0 - mean * mean / variance), kLeastShape, kLargestShape)
                : 0.0;
  const double scale = mean * (1.0 - shape);
  const double excess = std::abs(shape) < 1e-6 ? scale * std::log(ratio)
                                               : scale / shape * (std::pow(ratio, shape) - 1.0);
  return std::max(largest_, high + excess);
}

}  // namespace torsio
