#include "parts/rubber_spring.hpp"

#include <cmath>
#include <numbers>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "rubber spring";
/// The largest slope of x tanh x, where x tanh x = 1.
constexpr double kSteepestBlend = 1.1996786402577339;

/// Li₂(z) for −1 <= z <= 0, the series taken at z / (z − 1), which lies in 0..1/2 (Landen).
double dilogarithm(double z) {
  const double w = z / (z - 1.0);
  double sum = 0.0;
  double power = w;
  for (int n = 1; power > 1e-18; ++n) {
    sum += power / (static_cast<double>(n) * n);
    power *= w;
  }
  const double logarithm = std::log1p(-z);
  return -sum - 0.5 * logarithm * logarithm;
}

/// ∫₀ˣ t tanh t dt for x >= 0
double integral_of_x_tanh_x(double x) {
  // The closed form is a difference of numbers near 1; below this the series is exact to 1e-16.
  if (x < 0.02) return x * x * x * (1.0 / 3.0 - x * x * (1.0 / 15.0 - x * x * (2.0 / 105.0)));
  const double decay = std::exp(-2.0 * x);
  return 0.5 * x * x + x * std::log1p(decay) - std::numbers::pi * std::numbers::pi / 24.0 -
         0.5 * dilogarithm(-decay);
}

}  // namespace

RubberSpring::RubberSpring(const Parameters& parameters)
    : parameters_(parameters), branches_(parameters.branches), slip_(parameters.slip) {
  require_positive(kPlace, "stiffness_Nm_rad", parameters.stiffness_Nm_rad);
  require_positive(kPlace, "blend_rad", parameters.blend_rad);
  require_positive(kPlace, "elastic_share", parameters.elastic_share);
  require_parameter(
      kSteepestBlend * std::abs(parameters.asymmetry_Nm_rad) < parameters.stiffness_Nm_rad, kPlace,
      "1.2 |asymmetry_Nm_rad| < stiffness_Nm_rad", parameters.asymmetry_Nm_rad);
}

void RubberSpring::reset(double deflection_rad) noexcept {
  branches_.reset();
  slip_.reset();
  last_deflection_rad_ = deflection_rad;
  friction_Nm_ = 0.0;
}

double RubberSpring::elastic_energy(double deflection_rad) const noexcept {
  const double b = parameters_.blend_rad;
  const double blend = b * b * integral_of_x_tanh_x(std::abs(deflection_rad) / b);
  return parameters_.elastic_share *
         (0.5 * parameters_.stiffness_Nm_rad * deflection_rad * deflection_rad +
          (deflection_rad < 0.0 ? -1.0 : 1.0) * parameters_.asymmetry_Nm_rad * blend);
}

double RubberSpring::deflection(double torque_Nm) const noexcept {
  // |x tanh x| < |x|: the curve lies between the lines of slope K₀ − |a| and K₀ + |a|.
  const double softest = parameters_.elastic_share *
                         (parameters_.stiffness_Nm_rad - std::abs(parameters_.asymmetry_Nm_rad));
  double below = std::fmin(0.0, torque_Nm / softest);
  double above = std::fmax(0.0, torque_Nm / softest);
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (below + above);
    (elastic_torque(middle) < torque_Nm ? below : above) = middle;
  }
  return 0.5 * (below + above);
}

double RubberSpring::steepest(double /*load_Nm*/) const noexcept {
  return parameters_.elastic_share * (parameters_.stiffness_Nm_rad +
                                      kSteepestBlend * std::abs(parameters_.asymmetry_Nm_rad)) +
         branches_.stiffness() + slip_.stiffness(0.0);
}

}  // namespace torsio
