#include "evaluate/monitor/exceedance.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "numerics/quantile.hpp"

namespace torsio {

std::vector<double> persisting(std::span<const double> values, std::size_t window) {
  std::vector<double> result(values.size());
  std::deque<std::size_t> rising;  // of the window, each smaller than the later ones
  for (std::size_t n = 0; n < values.size(); ++n) {
    while (!rising.empty() && !(values[rising.back()] < values[n])) rising.pop_back();
    rising.push_back(n);
    if (rising.front() + window < n) rising.pop_front();
    result[n] = values[rising.front()];
  }
  return result;
}

void BlockMaxima::add(std::span<const double> values) {
  for (const double value : values) {
    if (value > maximum_) maximum_ = value;
    if (++in_block_ < block_) continue;
    if (std::isfinite(maximum_)) {
      maxima_.push_back(maximum_);
      largest_ = std::max(largest_, maximum_);
    }
    maximum_ = -std::numeric_limits<double>::infinity();
    in_block_ = 0;
  }
}

double BlockMaxima::threshold(double share) const {
  if (maxima_.empty()) return 0.0;
  const double high = quantile(maxima_, 0.9);
  double excess = 0.0;
  std::size_t above = 0;
  for (const double maximum : maxima_) {
    if (!(maximum > high)) continue;
    excess += maximum - high;
    ++above;
  }
  const double floor = 1.05 * largest_;
  if (above == 0) return floor;
  const double mean = excess / static_cast<double>(above);
  const double observed = static_cast<double>(above) / static_cast<double>(maxima_.size());
  return std::max(floor, high + mean * std::log(std::max(observed / share, 1.0)));
}

}  // namespace torsio
