#include "parts/friction.hpp"

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "LuGre friction";

}  // namespace

LuGreFriction::LuGreFriction(const Parameters& parameters)
    : parameters_(parameters),
      stribeck_(parameters.static_ratio, parameters.stribeck_rad_s),
      stiffness_Nm_rad_(parameters.static_ratio * parameters.coulomb_Nm / parameters.bristle_rad),
      is_only_viscous_(parameters.coulomb_Nm == 0.0 && parameters.load_factor == 0.0) {
  require_not_negative(kPlace, "coulomb_Nm", parameters.coulomb_Nm);
  require_not_negative(kPlace, "load_factor", parameters.load_factor);
  require_not_negative(kPlace, "viscous_Nms_rad", parameters.viscous_Nms_rad);
  require_positive(kPlace, "stribeck_rad_s", parameters.stribeck_rad_s);
  require_positive(kPlace, "bristle_rad", parameters.bristle_rad);
  require_parameter(parameters.static_ratio >= 1.0 && std::isfinite(parameters.static_ratio),
                    kPlace, "static_ratio >= 1", parameters.static_ratio);
  require_parameter(parameters.coulomb_Nm > 0.0 || parameters.load_factor == 0.0, kPlace,
                    "coulomb_Nm > 0 beside a load_factor", parameters.coulomb_Nm);
}

}  // namespace torsio
