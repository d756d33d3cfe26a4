#include <cmath>
#include <numbers>

#include "powers.hpp"
#include "torsio/design/spring.hpp"

namespace torsio {
namespace {

using std::numbers::pi;

}  // namespace

double rod_stiffness(double outer_m, double inner_m, double length_m, double shear_modulus_Pa) {
  return shear_modulus_Pa * pi * (fourth(outer_m) - fourth(inner_m)) / (32.0 * length_m);
}

double rod_stress(double outer_m, double inner_m, double torque_Nm) {
  return 16.0 * torque_Nm * outer_m / (pi * (fourth(outer_m) - fourth(inner_m)));
}

double buckling_stress(double outer_m, double inner_m, double elastic_modulus_Pa, double poisson) {
  const double wall = 0.5 * (outer_m - inner_m);
  const double radius = 0.25 * (outer_m + inner_m);
  return elastic_modulus_Pa /
         (3.0 * std::numbers::sqrt2 * std::pow(1.0 - poisson * poisson, 0.75)) *
         std::pow(wall / radius, 1.5);
}

double coil_rate(double wire_m, double coil_m, double active_coils, double shear_modulus_Pa) {
  return shear_modulus_Pa * fourth(wire_m) / (8.0 * std::pow(coil_m, 3) * active_coils);
}

double coil_stress(double wire_m, double coil_m, double force_N) {
  const double c = coil_m / wire_m;
  const double wahl = (4.0 * c - 1.0) / (4.0 * c - 4.0) + 0.615 / c;
  return wahl * 8.0 * force_N * coil_m / (pi * std::pow(wire_m, 3));
}

double disc_lever_torque(const BellevilleWasher& washer, double radius_m, double preload_m,
                         int parallel, int series, double angle_rad) {
  const double each = radius_m * std::sin(angle_rad) / series;
  return radius_m * std::cos(angle_rad) * parallel *
         (force(washer, preload_m + each) - force(washer, preload_m - each));
}

}  // namespace torsio
