#include "model/hysteresis/envelope.hpp"

#include <cmath>

#include "model/hysteresis/hysteresis_checks.hpp"

namespace torsio {

void Envelope::check(std::string_view family) const {
  for (const std::vector<double>* each : {&middle, &half_width})
    require(!each->empty() && each->size() <= kHighestDegree + 1, {family, "envelope"},
            "1 to " + std::to_string(kHighestDegree + 1) + " coefficients",
            static_cast<double>(each->size()));
  require_finite(middle, family, "middle");
  require_finite(half_width, family, "half_width");
  require(std::isfinite(centre), {family, "centre"}, "a finite number", centre);
  require(std::isfinite(half_range) && half_range > 0.0, {family, "half_range"},
          "a positive number", half_range);
}

Envelope::At Envelope::at(double x) const noexcept {
  const double z = (x - centre) / half_range;
  const double inside = std::clamp(z, -1.0, 1.0);
  double value = 0.0;
  double slope = 0.0;
  for (std::size_t i = middle.size(); i-- > 0;) {
    slope = slope * inside + value;
    value = value * inside + middle[i];
  }
  double width = 0.0;
  for (std::size_t i = half_width.size(); i-- > 0;) width = width * inside + half_width[i];
  return {value + slope * (z - inside), std::max(width, 0.0)};
}

double Envelope::widest(double lowest, double highest) const noexcept {
  double widest = 0.0;
  for (int i = 0; i <= kSamples; ++i)
    widest = std::max(widest, at(std::lerp(lowest, highest, double{1} * i / kSamples)).half_width);
  return widest;
}

}  // namespace torsio
