#include "parts/brake.hpp"

#include <fmt/format.h>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "brake";

const Brake::Parameters& checked(const Brake::Parameters& parameters) {
  require_positive(kPlace, "sliding_Nm", parameters.sliding_Nm);
  require_positive(kPlace, "static_Nm", parameters.static_Nm);
  require_parameter(
      parameters.static_Nm >= parameters.sliding_Nm, kPlace,
      fmt::format("a static torque of at least the sliding {} Nm", parameters.sliding_Nm),
      parameters.static_Nm);
  require_positive(kPlace, "bristle_rad", parameters.bristle_rad);
  require_positive(kPlace, "stribeck_rad_s", parameters.stribeck_rad_s);
  require_positive(kPlace, "activation_V", parameters.activation_V);
  require_not_negative(kPlace, "engage_s", parameters.engage_s);
  require_not_negative(kPlace, "release_s", parameters.release_s);
  return parameters;
}

}  // namespace

Brake::Brake(const Parameters& parameters)
    : parameters_(checked(parameters)),
      friction_({.coulomb_Nm = parameters.sliding_Nm,
                 .static_ratio = parameters.static_Nm / parameters.sliding_Nm,
                 .stribeck_rad_s = parameters.stribeck_rad_s,
                 .bristle_rad = parameters.bristle_rad}) {}

void Brake::reset(bool is_closed) noexcept {
  is_closed_ = is_closed;
  pending_s_ = 0.0;
  friction_.reset();
}

double Brake::step(double coil_V, double speed_rad_s, double dt_s) noexcept {
  const bool should_close = !(coil_V >= parameters_.activation_V);
  pending_s_ = should_close == is_closed_ ? 0.0 : pending_s_ + dt_s;
  const double delay_s = should_close ? parameters_.engage_s : parameters_.release_s;
  if (should_close != is_closed_ && pending_s_ >= delay_s) reset(should_close);
  return is_closed_ ? friction_.step(speed_rad_s, 0.0, dt_s) : 0.0;
}

}  // namespace torsio
