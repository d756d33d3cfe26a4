#include <fmt/format.h>

#include "control/controller_listing.hpp"
#include "core/checks.hpp"
#include "torsio/control/joint_cascade.hpp"

namespace torsio {

ThermalLimit::ThermalLimit(double rated_A, double peak_A, double time_constant_s,
                           double sample_rate_Hz)
    : rated_A_(rated_A), peak_A_(peak_A) {
  constexpr auto kPlace = "thermal limit";
  require_positive(kPlace, "rated_A", rated_A);
  require_positive(kPlace, "sample_rate_Hz", sample_rate_Hz);
  require_parameter(peak_A >= rated_A && std::isfinite(peak_A), kPlace,
                    fmt::format("a peak current of at least the rated {} A", rated_A), peak_A);
  fade_ = (peak_A * peak_A / (rated_A * rated_A) - 1.0) / (1.0 - kCold);
  const double shortest_s = (1.0 + fade_) / sample_rate_Hz;
  require_parameter(time_constant_s > shortest_s && std::isfinite(time_constant_s), kPlace,
                    fmt::format("time_constant_s > {}", shortest_s), time_constant_s);
  share_ = -std::expm1(-1.0 / (time_constant_s * sample_rate_Hz));
}

void ThermalLimit::list(ControllerListing& listing) const noexcept {
  listing.cascade.thermal_cold = kCold;
  listing.cascade.thermal_fade = fade_;
  listing.cascade.thermal_share = share_;
}

}  // namespace torsio
