#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace torsio {

/// The polynomial of order 4 through 2 w + 1 samples by least squares, at the middle one (Savitzky and Golay 1964). It
/// looks as far ahead as back, so that it has no phase.
class LocalQuartic {
 public:
  /// The fewest samples on either side that determine it.
  static constexpr std::size_t kLeastHalfWidth = 2;

  /// @param half_width at least `kLeastHalfWidth`
  LocalQuartic(std::size_t half_width, double sample_rate_Hz);

  [[nodiscard]] std::size_t half_width() const noexcept { return value_.size() - 1; }
  /// Value at a sample that has `half_width` samples on either side.
  [[nodiscard]] double value(std::span<const double> values, std::size_t at) const noexcept {
    return sum(value_, values, at);
  }
  /// Second derivative, in the unit of the values per s^2.
  [[nodiscard]] double curvature(std::span<const double> values, std::size_t at) const noexcept {
    return sum(curvature_, values, at);
  }
  /// Sum of the squares of the weights of the second derivative: its variance under white noise of variance 1.
  [[nodiscard]] double curvature_variance() const noexcept;
  /// The same of the difference to the second derivative of a narrower one.
  [[nodiscard]] double variance_of_difference(const LocalQuartic& narrower) const noexcept;

 private:
  /// Weights of the middle and of the samples on either side, which are symmetric.
  static double sum(const std::vector<double>& weights, std::span<const double> values,
                    std::size_t at) noexcept;

  std::vector<double> value_;
  std::vector<double> curvature_;
};

}  // namespace torsio
