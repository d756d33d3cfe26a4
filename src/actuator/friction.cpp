#include "torsio/actuator/friction.hpp"

#include <cmath>

#include "checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "LuGre friction";

}  // namespace

LuGreFriction::LuGreFriction(const Parameters& parameters)
    : parameters_(parameters),
      inverse_stribeck_squared_(1.0 / (parameters.stribeck_rad_s * parameters.stribeck_rad_s)),
      inverse_bristle_(1.0 / parameters.bristle_rad),
      is_only_viscous_(parameters.coulomb_Nm == 0.0 && parameters.load_factor == 0.0) {
  require_not_negative(kPlace, "coulomb_Nm", parameters.coulomb_Nm);
  require_not_negative(kPlace, "load_factor", parameters.load_factor);
  require_not_negative(kPlace, "viscous_Nms_rad", parameters.viscous_Nms_rad);
  require_positive(kPlace, "stribeck_rad_s", parameters.stribeck_rad_s);
  require_positive(kPlace, "bristle_rad", parameters.bristle_rad);
  require(parameters.static_ratio >= 1.0 && std::isfinite(parameters.static_ratio), kPlace,
          "static_ratio >= 1", parameters.static_ratio);
}

double LuGreFriction::stiffness(double load_Nm) const noexcept {
  return (parameters_.coulomb_Nm + parameters_.load_factor * std::abs(load_Nm)) *
         parameters_.static_ratio * inverse_bristle_;
}

}  // namespace torsio
