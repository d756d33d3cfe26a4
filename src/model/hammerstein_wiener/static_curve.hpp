#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// A function of one number that is linear in its coefficients, in one of two forms:
///
///     polynomial        y = sum_i v_i z^i,   z = (x - centre) / half_range
///     piecewise linear  y = v_j + (v_j+1 - v_j) (x - k_j) / (k_j+1 - k_j)  between knots k_j, k_j+1
///
/// Beyond the first and the last knot the outer segments are extrapolated.
struct StaticCurve {
  std::vector<double> knots = {};           ///< ascending, in x's unit; empty: a polynomial
  std::vector<double> values = {0.0, 1.0};  ///< v: constant first, or one per knot
  double centre = 0.0;                      ///< middle of a polynomial's range; x's unit
  double half_range = 1.0;                  ///< x's unit, > 0

  static constexpr std::size_t kMaxValues = 200;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("knots", self.knots);
    visit("values", self.values);
    visit("centre", self.centre);
    visit("half_range", self.half_range);
  }
  bool operator==(const StaticCurve&) const = default;

  /// @throws Error that names `place` if the values are none or too many, knots do not ascend or are
  /// not one a value, half_range is not positive or a number is not finite.
  void check(std::string_view place) const;

  [[nodiscard]] double operator()(double x) const noexcept TORSIO_REALTIME {
    if (!knots.empty()) return segment_value(x);
    const double z = (x - centre) / half_range;
    double y = 0.0;
    for (std::size_t i = values.size(); i-- > 0;) y = y * z + values[i];
    return y;
  }

  /// dy/dx; at a knot the slope of the segment after it.
  [[nodiscard]] double slope(double x) const noexcept;
  /// The factor of v_i: z^i, or the hat over knot i.
  [[nodiscard]] double basis(std::size_t i, double x) const noexcept;
  /// The knot that begins the segment of x; there are knots.
  [[nodiscard]] std::size_t segment(double x) const noexcept;

 private:
  [[nodiscard]] double segment_value(double x) const noexcept;
};

struct Interval {
  double lowest = 0.0;
  double highest = 0.0;
};

/// The widest part of `within` around its middle in which the curve only rises or only falls.
/// @param within finite, lowest < highest
[[nodiscard]] Interval monotone_part(const StaticCurve& curve, Interval within);

}  // namespace torsio
