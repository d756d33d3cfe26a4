#include "parts/slip_clutch.hpp"

#include <algorithm>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "slip clutch";

}  // namespace

SlipClutch::SlipClutch(const Parameters& parameters)
    : parameters_(parameters),
      inverse_ratio_(1.0 / parameters.ratio),
      sliding_Nm_(parameters.sliding_ratio * parameters.static_torque_Nm) {
  require_positive(kPlace, "ratio", parameters.ratio);
  require_positive(kPlace, "stiffness_Nm_rad", parameters.stiffness_Nm_rad);
  require_positive(kPlace, "static_torque_Nm", parameters.static_torque_Nm);
  require_positive(kPlace, "sliding_ratio", parameters.sliding_ratio);
  require_parameter(parameters.sliding_ratio <= 1.0, kPlace, "sliding_ratio <= 1",
                    parameters.sliding_ratio);
  require_not_negative(kPlace, "damping_Nms_rad", parameters.damping_Nms_rad);
}

void SlipClutch::reset(double rotor_angle_rad, double middle_angle_rad) noexcept {
  twist_rad_ = rotor_angle_rad * inverse_ratio_ - middle_angle_rad;
  twist_rate_rad_s_ = 0.0;
  is_slipping_ = false;
  const double limit_Nm = parameters_.static_torque_Nm;
  cable_Nm_ = std::clamp(parameters_.stiffness_Nm_rad * twist_rad_, -limit_Nm, limit_Nm);
  slip_rad_ =
      std::abs(cable_Nm_) < limit_Nm ? 0.0 : twist_rad_ - cable_Nm_ / parameters_.stiffness_Nm_rad;
  torque_Nm_ = cable_Nm_;
}

}  // namespace torsio
