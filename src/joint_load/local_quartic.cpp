#include "joint_load/local_quartic.hpp"

#include <array>
#include <cmath>

namespace torsio {
namespace {

/// Inverse of the symmetric matrix of the moments sum x^(i + j), i and j = 0, 2, 4.
std::array<std::array<double, 3>, 3> inverse_of_moments(const std::array<double, 5>& moments) {
  const auto& [m0, m2, m4, m6, m8] = moments;
  const double c00 = m4 * m8 - m6 * m6;
  const double c01 = m4 * m6 - m2 * m8;
  const double c02 = m2 * m6 - m4 * m4;
  const double c11 = m0 * m8 - m4 * m4;
  const double c12 = m2 * m4 - m0 * m6;
  const double c22 = m0 * m4 - m2 * m2;
  const double determinant = m0 * c00 + m2 * c01 + m4 * c02;
  std::array<std::array<double, 3>, 3> inverse{{{c00, c01, c02}, {c01, c11, c12}, {c02, c12, c22}}};
  for (auto& row : inverse)
    for (double& value : row) value /= determinant;
  return inverse;
}

}  // namespace

LocalQuartic::LocalQuartic(std::size_t half_width, double sample_rate_Hz)
    : value_(half_width + 1), curvature_(half_width + 1) {
  const auto width = static_cast<double>(half_width);  // x is -1 to 1, for the digits
  std::array<double, 5> moments{};
  for (std::size_t i = 0; i <= half_width; ++i) {
    const double square = std::pow(static_cast<double>(i) / width, 2);
    double power = i == 0 ? 1.0 : 2.0;
    for (double& moment : moments) {
      moment += power;
      power *= square;
    }
  }
  const auto inverse = inverse_of_moments(moments);
  const double per_s2 = std::pow(sample_rate_Hz / width, 2);
  for (std::size_t i = 0; i <= half_width; ++i) {
    const double square = std::pow(static_cast<double>(i) / width, 2);
    const std::array<double, 3> powers = {1.0, square, square * square};
    for (std::size_t k = 0; k < 3; ++k) {
      value_[i] += inverse[0][k] * powers[k];
      curvature_[i] += 2.0 * per_s2 * inverse[1][k] * powers[k];
    }
  }
}

double LocalQuartic::sum(const std::vector<double>& weights, std::span<const double> values,
                         std::size_t at) noexcept {
  double sum = weights[0] * values[at];
  for (std::size_t i = 1; i < weights.size(); ++i)
    sum += weights[i] * (values[at - i] + values[at + i]);
  return sum;
}

double LocalQuartic::curvature_variance() const noexcept {
  double squares = curvature_[0] * curvature_[0];
  for (std::size_t i = 1; i < curvature_.size(); ++i)
    squares += 2.0 * curvature_[i] * curvature_[i];
  return squares;
}

double LocalQuartic::variance_of_difference(const LocalQuartic& narrower) const noexcept {
  double squares = 0.0;
  for (std::size_t i = 0; i < curvature_.size(); ++i) {
    const double other = i < narrower.curvature_.size() ? narrower.curvature_[i] : 0.0;
    const double difference = curvature_[i] - other;
    squares += (i == 0 ? 1.0 : 2.0) * difference * difference;
  }
  return squares;
}

}  // namespace torsio
