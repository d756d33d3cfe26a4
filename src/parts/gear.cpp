#include "parts/gear.hpp"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "gear";

}  // namespace

Gear::Gear(const Parameters& parameters)
    : parameters_(parameters),
      inverse_ratio_(1.0 / parameters.ratio),
      has_error_(parameters.error_rad != std::array{0.0, 0.0}),
      hysteresis_({.constant_Nm = parameters.hysteresis_Nm,
                   .load_factor = 0.0,
                   .share = {1.0},
                   .break_away_rad = {parameters.break_away_rad}}) {
  require_positive(kPlace, "ratio", parameters.ratio);
  require_positive(kPlace, "stiffness_Nm_rad", parameters.stiffness_Nm_rad);
  require_not_negative(kPlace, "damping_Nms_rad", parameters.damping_Nms_rad);
  for (std::size_t i = 0; i < in_phase_.size(); ++i) {
    require_not_negative(kPlace, "error_rad", parameters.error_rad[i]);
    in_phase_[i] = parameters.error_rad[i] * std::cos(parameters.error_phase_rad[i]);
    quadrature_[i] = parameters.error_rad[i] * std::sin(parameters.error_phase_rad[i]);
  }
}

void Gear::reset(double rotor_angle_rad, double output_angle_rad) noexcept {
  hysteresis_.reset();
  hysteresis_Nm_ = 0.0;
  twist_rad_ = kinematics(rotor_angle_rad).angle_rad - output_angle_rad;
  twist_rate_rad_s_ = 0.0;
}

}  // namespace torsio
