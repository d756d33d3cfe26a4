#pragma once

#include <cmath>
#include <span>

#include "model/common/affine_inverse.hpp"
#include "model/hysteresis/increment.hpp"
#include "model/hysteresis/slip_bank.hpp"

namespace torsio {

/// The x at which y(x) = wanted, y a broken line of the next input whose corners are where stops
/// begin to slip.
/// @param thresholds of the stops in this tick
template <class Curve>
Estimate broken_line_inverse(double wanted, const SlipBank& stops, const Increment& increment,
                             std::span<const double> thresholds, const Curve& curve,
                             Features features) noexcept {
  const double here = increment.last();
  double reach = std::abs(here) > 0.0 ? std::abs(here) : 1.0;
  if (!thresholds.empty()) reach = 4.0 * thresholds.back();
  // Two points beyond the last corner on either side give the slopes there.
  const double farthest_down = curve(here - reach);
  const double farthest_up = curve(here + reach);
  if (!std::isfinite(farthest_down) || !std::isfinite(farthest_up))
    return detail::no_inverse(features);
  const double sign = farthest_up < farthest_down ? -1.0 : 1.0;
  struct Point {
    double x;
    double y;
  };
  Point below{here - reach, sign * farthest_down};
  Point above{here + reach, sign * farthest_up};
  const double aim = sign * wanted;
  const auto extrapolated = [&](const Point& end, double outward) -> Estimate {
    const double slope = sign * curve(end.x + outward) - end.y;
    const double x = end.x + outward * (aim - end.y) / slope;
    if (slope * outward > 0.0 && std::isfinite(x)) return {.value = x};
    if (above.y == below.y) return detail::no_inverse(features);
    return {.value = end.x, .fault = Fault::outside_training_range};
  };
  if (!(aim >= below.y)) return extrapolated(below, -reach);
  if (aim > above.y) return extrapolated(above, reach);
  const auto narrow = [&](double x) {
    const Point corner{x, sign * curve(x)};
    if (corner.y <= aim && corner.x > below.x) below = corner;
    if (corner.y >= aim && corner.x < above.x) above = corner;
  };
  narrow(here);
  for (std::size_t i = 0; i < stops.size(); ++i) {
    narrow(here + (thresholds[i] - stops.forces()[i]));
    narrow(here - (thresholds[i] + stops.forces()[i]));
  }
  const double share = above.y == below.y ? 0.5 : (aim - below.y) / (above.y - below.y);
  const double x = below.x + share * (above.x - below.x);
  return std::isfinite(x) ? Estimate{.value = x} : detail::no_inverse(features);
}

}  // namespace torsio
