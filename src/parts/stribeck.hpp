#pragma once

#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The Stribeck curve over its level at speed: 1 + (r − 1) exp(−(v / v_s)²), r at rest.
class StribeckCurve {
 public:
  StribeckCurve(double static_ratio, double stribeck_rad_s) noexcept
      : excess_(static_ratio - 1.0),
        inverse_stribeck_squared_(1.0 / (stribeck_rad_s * stribeck_rad_s)) {}

  double operator()(double speed_rad_s) const noexcept TORSIO_REALTIME {
    const double exponent = speed_rad_s * speed_rad_s * inverse_stribeck_squared_;
    if (!(excess_ > 0.0) || exponent > 40.0) return 1.0;  // exp(-40) is below the last bit of 1
    return 1.0 + excess_ * std::exp(-exponent);
  }

 private:
  double excess_;
  double inverse_stribeck_squared_;
};

}  // namespace torsio
