#pragma once

#include <algorithm>

namespace torsio::detail {

/// A number and its derivative with respect to x: formulas that are written for any number return their
/// slope, too. Beyond a limit the slope is 0.
struct Sloped {
  double value = 0.0;
  double slope = 0.0;

  friend Sloped operator+(Sloped a, double b) noexcept { return {a.value + b, a.slope}; }
  friend Sloped operator-(Sloped a, double b) noexcept { return {a.value - b, a.slope}; }
  friend Sloped operator-(double a, Sloped b) noexcept { return {a - b.value, -b.slope}; }
  friend Sloped operator*(Sloped a, double b) noexcept { return {a.value * b, a.slope * b}; }
  friend Sloped operator*(double a, Sloped b) noexcept { return b * a; }
  friend Sloped operator*(Sloped a, Sloped b) noexcept {
    return {a.value * b.value, a.slope * b.value + a.value * b.slope};
  }
  friend Sloped operator/(Sloped a, double b) noexcept { return {a.value / b, a.slope / b}; }
  Sloped& operator+=(Sloped b) noexcept {
    value += b.value;
    slope += b.slope;
    return *this;
  }
  Sloped& operator+=(double b) noexcept {
    value += b;
    return *this;
  }
};

[[nodiscard]] inline double value_of(double x) noexcept { return x; }
[[nodiscard]] inline double value_of(Sloped x) noexcept { return x.value; }

[[nodiscard]] inline double limited(double x, double low, double high) noexcept {
  return std::min(std::max(x, low), high);
}
[[nodiscard]] inline Sloped limited(Sloped x, double low, double high) noexcept {
  const bool is_inside = x.value > low && x.value < high;
  return {limited(x.value, low, high), is_inside ? x.slope : 0.0};
}

}  // namespace torsio::detail
