#pragma once

#include <algorithm>
#include <cmath>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// The share of the peak current that a measured motor temperature allows: all of it up to one
/// temperature, from there linearly less, none from a second one on. It acts together with
/// `ThermalLimit`, which follows the copper faster than a temperature sensor can. A temperature that
/// is not finite allows none.
///
/// Source: paper 003 section 2 ("in time power reduction" by measured motor temperatures); the linear
/// course is ours.
class TemperatureDerating {
 public:
  /// @throws Error unless 0 < begins_K < ends_K, both finite
  TemperatureDerating(double begins_K, double ends_K);

  [[nodiscard]] double allowed_share(double temperature_K) const noexcept TORSIO_REALTIME {
    if (!std::isfinite(temperature_K)) return 0.0;
    return std::clamp((ends_K_ - temperature_K) / (ends_K_ - begins_K_), 0.0, 1.0);
  }

 private:
  double begins_K_;
  double ends_K_;
};

}  // namespace torsio
