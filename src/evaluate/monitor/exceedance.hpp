#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace torsio {

/// The largest value that `count` of the last samples reach: what persists. The window is that of
/// `Monitor`, `kPersistenceWindow` times as long. NaN is
/// no sample and takes no place among them, as `Monitor` continues its counts over invalid sources;
/// NaN for it, and until there have been `count` samples.
[[nodiscard]] std::vector<double> persisting(std::span<const double> values, std::size_t count);

/// The maxima of a statistic over blocks of equal length, and the threshold that it exceeds at a
/// given rate.
class BlockMaxima {
 public:
  /// @param block samples of a block
  explicit BlockMaxima(std::size_t block) : block_(block) {}

  /// Adds samples; NaN is none. Blocks run across calls.
  void add(std::span<const double> values);
  void add(double value);

  /// Complete blocks that had a value.
  [[nodiscard]] std::size_t size() const noexcept { return maxima_.size(); }
  [[nodiscard]] double largest() const noexcept { return largest_; }

  /// The value that is exceeded in a share `share` of the blocks: u + s/xi ((p / share)^xi - 1), the
  /// generalised Pareto tail of the maxima above their 90 % quantile u (p the share of those; shape
  /// xi and scale s by moments, xi limited to -0.4 to 0, and 0 for fewer than 30 of them); at least
  /// the largest one. 0 if there is no block. What a joint measures is bounded: an exponential tail
  /// (xi = 0) is the heaviest one, and a larger xi is an error of its estimate.
  [[nodiscard]] double exceeded_in(double share) const;
  /// The same of values that are not negative, at least 1.05 times the largest one.
  [[nodiscard]] double threshold(double share) const;

 private:
  std::size_t block_;
  std::size_t in_block_ = 0;
  double maximum_ = -std::numeric_limits<double>::infinity();
  double largest_ = -std::numeric_limits<double>::infinity();
  std::vector<double> maxima_;
};

}  // namespace torsio
