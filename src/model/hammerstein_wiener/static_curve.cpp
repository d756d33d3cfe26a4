#include "model/hammerstein_wiener/static_curve.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/all_finite.hpp"
#include "core/checks.hpp"
#include "model/hammerstein_wiener/transfer_function.hpp"

namespace torsio {
namespace {

/// Where the curve may turn: zeros of a polynomial's slope, or the knots.
std::vector<double> possible_turns(const StaticCurve& curve) {
  if (!curve.knots.empty()) return curve.knots;
  std::vector<double> slope;  // highest power first
  for (std::size_t i = curve.values.size(); i-- > 1;)
    slope.push_back(static_cast<double>(i) * curve.values[i]);
  std::vector<double> turns;
  for (const std::complex<double> root : polynomial_roots(slope)) {
    constexpr double kReal = 1e-9;
    if (std::abs(root.imag()) < kReal * (1.0 + std::abs(root)))
      turns.push_back(curve.centre + curve.half_range * root.real());
  }
  std::ranges::sort(turns);
  return turns;
}

}  // namespace

void StaticCurve::check(std::string_view place) const {
  require(!values.empty() && values.size() <= kMaxValues, place, "1 to 200 values",
          std::to_string(values.size()));
  require(all_finite(values) && all_finite(knots) && std::isfinite(centre), place, "finite numbers",
          "one that is not finite");
  require(std::isfinite(half_range) && half_range > 0.0, place, "a positive half_range",
          half_range);
  if (knots.empty()) return;
  require(knots.size() == values.size() && knots.size() >= 2, place,
          "two knots or more, one a value",
          std::to_string(knots.size()) + " knots, " + std::to_string(values.size()) + " values");
  require(std::ranges::is_sorted(knots, std::ranges::less_equal{}), place, "knots that ascend",
          "one that does not");
}

std::size_t StaticCurve::segment(double x) const noexcept {
  const auto next = std::upper_bound(knots.begin() + 1, knots.end() - 1, x);
  return static_cast<std::size_t>(next - knots.begin()) - 1;
}

double StaticCurve::segment_value(double x) const noexcept {
  const std::size_t j = segment(x);
  const double share = (x - knots[j]) / (knots[j + 1] - knots[j]);
  return values[j] + (values[j + 1] - values[j]) * share;
}

double StaticCurve::slope(double x) const noexcept {
  if (!knots.empty()) {
    const std::size_t j = segment(x);
    return (values[j + 1] - values[j]) / (knots[j + 1] - knots[j]);
  }
  const double z = (x - centre) / half_range;
  double rise = 0.0;
  for (std::size_t i = values.size(); i-- > 1;)
    rise = rise * z + static_cast<double>(i) * values[i];
  return rise / half_range;
}

double StaticCurve::basis(std::size_t i, double x) const noexcept {
  if (knots.empty()) {
    const double z = (x - centre) / half_range;
    double power = 1.0;
    for (std::size_t k = 0; k < i; ++k) power *= z;
    return power;
  }
  const std::size_t j = segment(x);
  if (i != j && i != j + 1) return 0.0;
  const double share = (x - knots[j]) / (knots[j + 1] - knots[j]);
  return i == j ? 1.0 - share : share;
}

Interval monotone_part(const StaticCurve& curve, Interval within) {
  const double middle = 0.5 * (within.lowest + within.highest);
  constexpr double kAside = 1e-9;  // share of the range: a slope at a knot is that of one side only
  const double aside = kAside * (within.highest - within.lowest);
  const double sign = std::copysign(1.0, curve.slope(middle));
  Interval part = within;
  for (const double turn : possible_turns(curve)) {
    if (turn <= within.lowest || turn >= within.highest) continue;
    if (turn > middle && turn < part.highest && curve.slope(turn + aside) * sign <= 0.0)
      part.highest = turn;
    if (turn <= middle && turn > part.lowest && curve.slope(turn - aside) * sign <= 0.0)
      part.lowest = turn;
  }
  return part;
}

}  // namespace torsio
