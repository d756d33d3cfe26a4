#include "parts/elastic_curve.hpp"

#include <algorithm>
#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "elastic curve";

/// ln cosh x without overflow
double log_cosh(double x) {
  const double magnitude = std::abs(x);
  return magnitude + std::log1p(std::exp(-2.0 * magnitude)) - std::log(2.0);
}

}  // namespace

ElasticCurve::ElasticCurve(const Parameters& parameters)
    : parameters_(parameters),
      stiffness_up_(parameters.stiffness_Nm_rad * (1.0 + parameters.asymmetry)),
      stiffness_down_(parameters.stiffness_Nm_rad * (1.0 - parameters.asymmetry)),
      stage_onset_rad_(parameters.stage_rad) {
  require_positive(kPlace, "stiffness_Nm_rad", parameters.stiffness_Nm_rad);
  require_not_negative(kPlace, "half_gap_rad", parameters.half_gap_rad);
  require_not_negative(kPlace, "stage_stiffness_Nm_rad", parameters.stage_stiffness_Nm_rad);
  require_parameter(std::abs(parameters.asymmetry) < 1.0, kPlace, "asymmetry inside -1..1",
                    parameters.asymmetry);
  require_parameter(parameters.stage_rad >= 0.0, kPlace, "stage_rad >= 0", parameters.stage_rad);
  if (!std::isfinite(parameters.stage_rad)) return;
  double below = parameters.stage_rad;
  double above = parameters.stage_rad + parameters.half_gap_rad;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (below + above);
    (without_play(middle) < parameters.stage_rad ? below : above) = middle;
  }
  stage_onset_rad_ = 0.5 * (below + above);
}

double ElasticCurve::energy(double deflection_rad) const noexcept {
  const double b = parameters_.half_gap_rad;
  const double magnitude = std::abs(deflection_rad);
  // ∫ x dδ = δ²/2 − b² ln cosh(δ/b)
  const auto integral_of_x = [b](double deflection) {
    return 0.5 * deflection * deflection - (b > 0.0 ? b * b * log_cosh(deflection / b) : 0.0);
  };
  double energy_J =
      (deflection_rad > 0.0 ? stiffness_up_ : stiffness_down_) * integral_of_x(magnitude);
  if (magnitude > stage_onset_rad_) {
    energy_J += parameters_.stage_stiffness_Nm_rad *
                (integral_of_x(magnitude) - integral_of_x(stage_onset_rad_) -
                 parameters_.stage_rad * (magnitude - stage_onset_rad_));
  }
  return energy_J;
}

double ElasticCurve::deflection(double torque_Nm) const noexcept {
  // The curve rises monotonically: bisection between 0 and where the first stage alone, play added,
  // gives more.
  const double sign = torque_Nm < 0.0 ? -1.0 : 1.0;
  double below = 0.0;
  double above =
      std::abs(torque_Nm) / std::min(stiffness_up_, stiffness_down_) + parameters_.half_gap_rad;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (below + above);
    (std::abs(torque(sign * middle)) < std::abs(torque_Nm) ? below : above) = middle;
  }
  return sign * 0.5 * (below + above);
}

double ElasticCurve::steepest() const noexcept {
  return std::max(stiffness_up_, stiffness_down_) +
         (std::isfinite(parameters_.stage_rad) ? parameters_.stage_stiffness_Nm_rad : 0.0);
}

}  // namespace torsio
