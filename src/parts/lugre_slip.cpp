#include "parts/lugre_slip.hpp"

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "LuGre slip";

}  // namespace

LuGreSlip::LuGreSlip(const Parameters& parameters)
    : parameters_(parameters),
      stribeck_(parameters.static_ratio, parameters.stribeck_rad_s),
      per_bristle_(1.0 / parameters.bristle_rad),
      limit_Nm_(parameters.constant_Nm) {
  require_not_negative(kPlace, "constant_Nm", parameters.constant_Nm);
  require_not_negative(kPlace, "load_factor", parameters.load_factor);
  require_positive(kPlace, "stribeck_rad_s", parameters.stribeck_rad_s);
  require_positive(kPlace, "bristle_rad", parameters.bristle_rad);
  require_parameter(parameters.static_ratio >= 1.0 && std::isfinite(parameters.static_ratio),
                    kPlace, "static_ratio >= 1", parameters.static_ratio);
}

}  // namespace torsio
