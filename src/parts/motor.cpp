#include "parts/motor.hpp"

#include <cmath>

#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kPlace = "motor";

}  // namespace

Motor::Motor(const Parameters& parameters)
    : parameters_(parameters),
      inverse_resistance_(1.0 / parameters.resistance_Ohm),
      ripple_Nm_(parameters.ripple * parameters.torque_constant_Nm_A * parameters.peak_current_A) {
  require_positive(kPlace, "torque_constant_Nm_A", parameters.torque_constant_Nm_A);
  require_positive(kPlace, "peak_current_A", parameters.peak_current_A);
  require_positive(kPlace, "current_time_constant_s", parameters.current_time_constant_s);
  require_positive(kPlace, "supply_V", parameters.supply_V);
  require_positive(kPlace, "resistance_Ohm", parameters.resistance_Ohm);
  require_not_negative(kPlace, "ripple", parameters.ripple);
  require_not_negative(kPlace, "ripple_order", parameters.ripple_order);
}

void Motor::set_period(double dt_s) noexcept {
  decay_ = std::exp(-dt_s / parameters_.current_time_constant_s);
}

}  // namespace torsio
