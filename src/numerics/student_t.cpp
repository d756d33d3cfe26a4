#include "numerics/student_t.hpp"

#include <cmath>
#include <numbers>

namespace torsio {

// Abramowitz and Stegun 26.7.3 and 26.7.4, exact for whole degrees of freedom.
double student_t_within(double t, std::size_t degrees_of_freedom) {
  const auto nu = static_cast<double>(degrees_of_freedom);
  const double angle = std::atan(t / std::sqrt(nu));
  const double square = std::cos(angle) * std::cos(angle);
  const bool is_odd = degrees_of_freedom % 2 == 1;
  double sum = 0.0;
  double term = is_odd ? std::cos(angle) : 1.0;
  for (std::size_t k = is_odd ? 3 : 2; k <= degrees_of_freedom; k += 2) {
    sum += term;
    term *= square * static_cast<double>(k - 1) / static_cast<double>(k);
  }
  if (!is_odd) return std::sin(angle) * sum;
  return 2.0 / std::numbers::pi * (angle + std::sin(angle) * sum);
}

double student_t(double probability, std::size_t degrees_of_freedom) {
  double low = 0.0;
  double high = 1.0;
  constexpr double kHuge = 1e12;
  while (high < kHuge && student_t_within(high, degrees_of_freedom) < probability) high *= 2.0;
  constexpr int kHalvings = 80;
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (student_t_within(middle, degrees_of_freedom) < probability ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace torsio
