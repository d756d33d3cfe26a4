#pragma once

#include <cmath>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/checks.hpp"

namespace torsio {

inline void require_finite(std::span<const double> values, std::string_view family,
                           std::string_view field) {
  for (const double each : values)
    require(std::isfinite(each), {family, field}, "finite numbers", each);
}

/// The same values. @throws Error unless they are positive, finite and ascending.
inline const std::vector<double>& ascending_thresholds(const std::vector<double>& thresholds,
                                                       std::string_view family) {
  double before = 0.0;
  for (const double each : thresholds) {
    require(std::isfinite(each) && each > before, {family, "thresholds"},
            "positive, ascending numbers", each);
    before = each;
  }
  return thresholds;
}

}  // namespace torsio
