#include "identify/drive/drive_friction.hpp"

#include <cmath>

namespace torsio {

double drive_friction_Nm(const DriveValues& values, double speed_rad_s, double load_Nm) {
  using enum DriveParameter;
  const double speed = std::abs(speed_rad_s);
  const double at_rest_1 = std::exp(-speed / at(values, load_speed));
  const double load_share = at(values, load_friction) + at(values, load_stribeck) * at_rest_1;
  return at(values, coulomb) + load_share * load_Nm +
         at(values, stribeck) * std::exp(-speed / at(values, stribeck_speed)) +
         at(values, viscous) * speed;
}

}  // namespace torsio
