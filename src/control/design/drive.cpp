#include "torsio/control/design/drive.hpp"

#include <fmt/format.h>

#include "core/checks.hpp"

namespace torsio {

void Drive::check() const {
  constexpr auto kPlace = "drive";
  require_positive(kPlace, "ratio", ratio);
  require_positive(kPlace, "torque_constant_Nm_A", torque_constant_Nm_A);
  require_positive(kPlace, "rotor_inertia_kg_m2", rotor_inertia_kg_m2);
  require_not_negative(kPlace, "viscous_Nms_rad", viscous_Nms_rad);
  require_not_negative(kPlace, "coulomb_Nm", coulomb_Nm);
  require_positive(kPlace, "rated_current_A", rated_current_A);
  require_positive(kPlace, "peak_current_A", peak_current_A);
  require_parameter(peak_current_A >= rated_current_A, kPlace,
                    fmt::format("a peak current of at least the rated {} A", rated_current_A),
                    peak_current_A);
  require_positive(kPlace, "current_time_constant_s", current_time_constant_s);
  require_positive(kPlace, "supply_V", supply_V);
  require_positive(kPlace, "resistance_Ohm", resistance_Ohm);
}

}  // namespace torsio
