#include "torsio/control/drive.hpp"

#include <fmt/format.h>

#include <variant>

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
  require(peak_current_A >= rated_current_A, kPlace,
          fmt::format("a peak current of at least the rated {} A", rated_current_A),
          peak_current_A);
  require_positive(kPlace, "current_time_constant_s", current_time_constant_s);
  require_positive(kPlace, "supply_V", supply_V);
  require_positive(kPlace, "resistance_Ohm", resistance_Ohm);
}

Drive drive_of(const DataSheet& sheet) {
  double ratio = std::visit([](const auto& stage) { return stage.ratio.value; }, sheet.first);
  if (const auto* const gear = std::get_if<GearSheet>(&sheet.second)) ratio *= gear->ratio.value;
  return {.ratio = ratio,
          .torque_constant_Nm_A = sheet.motor.torque_constant_Nm_A.value,
          .rotor_inertia_kg_m2 = sheet.motor.rotor_inertia_kg_m2.value,
          .viscous_Nms_rad = sheet.friction.viscous_Nms_rad.value +
                             sheet.motor.viscous_Nms_rad.value * ratio * ratio,
          .coulomb_Nm = sheet.friction.coulomb_Nm.value,
          .rated_current_A = sheet.rating.current_A.value,
          .peak_current_A = sheet.motor.peak_current_ratio.value * sheet.rating.current_A.value,
          .current_time_constant_s = sheet.motor.current_time_constant_s.value,
          .supply_V = sheet.motor.supply_V.value,
          .resistance_Ohm = sheet.motor.winding_resistance_Ohm.value};
}

}  // namespace torsio
