#include "torsio/actuator/data_sheet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr SheetValue in_rad(SheetValue degrees) {
  return {rad_from_deg(degrees.value), degrees.origin};
}
constexpr SheetValue per_rad(SheetValue per_degree) {
  return {deg_from_rad(per_degree.value), per_degree.origin};
}
constexpr std::array<SheetValue, 4> kBreakAway = {in_rad(assumed(0.02)), in_rad(assumed(0.06)),
                                                  in_rad(assumed(0.18)), in_rad(assumed(0.5))};

// SPEC section 4.2. The winding resistance is assumed for motors of that class: it only bounds the
// current at high speed.
constexpr std::array<DataSheet, 4> kSheets = {
    DataSheet{.name = "dfki-28",
              .title = "28 Nm series-elastic actuator",
              .rated_torque_Nm = printed(28.0),
              .rated_current_A = printed(4.8),
              .top_speed_rad_s = in_rad(printed(300.0)),
              .torque_constant_Nm_A = printed(0.057),
              .rotor_inertia_kg_m2 = assumed(2e-5),
              .winding_resistance_Ohm = assumed(0.6),
              .gear_ratio = printed(100.0),
              .gear_inertia_kg_m2 = assumed(0.004),
              .gear_stiffness_Nm_rad = assumed(4.7e3),
              .friction_Nm = derived(0.65),
              .friction_viscous_Nms_rad = assumed(1.0),
              .spring_stiffness_Nm_rad = per_rad(printed(5.6)),
              .spring_half_gap_rad = in_rad(assumed(0.03)),
              .spring_asymmetry = assumed(0.04),
              .spring_friction_Nm = assumed(0.76),
              .spring_load_friction = assumed(0.05),
              .spring_break_away_rad = kBreakAway,
              .bearing_friction_Nm = assumed(0.1),
              .torque_range_Nm = printed(50.0)},
    DataSheet{.name = "dfki-50",
              .title = "50 Nm series-elastic actuator with a two-stage spring",
              .rated_torque_Nm = printed(50.0),
              .rated_current_A = printed(5.0),
              .top_speed_rad_s = in_rad(printed(157.0)),
              .torque_constant_Nm_A = derived(0.104),
              .rotor_inertia_kg_m2 = assumed(6e-5),
              .winding_resistance_Ohm = assumed(0.5),
              .gear_ratio = printed(120.0),
              .gear_inertia_kg_m2 = assumed(0.01),
              .gear_stiffness_Nm_rad = assumed(1.6e4),
              .friction_Nm = assumed(6.0),
              .friction_viscous_Nms_rad = assumed(10.0),
              .spring_stiffness_Nm_rad = per_rad(printed(10.0)),
              .spring_stage_rad = in_rad(printed(5.0)),
              .spring_stage_stiffness_Nm_rad = per_rad(assumed(20.0)),
              .spring_half_gap_rad = in_rad(assumed(0.015)),
              .spring_asymmetry = assumed(0.03),
              .spring_friction_Nm = derived(1.36),
              .spring_load_friction = assumed(0.03),
              .spring_break_away_rad = kBreakAway,
              .bearing_friction_Nm = assumed(0.2),
              .torque_range_Nm = printed(50.0)},
    DataSheet{.name = "dfki-120",
              .title = "120 Nm series-elastic actuator",
              .rated_torque_Nm = printed(120.0),
              .rated_current_A = printed(7.0),
              .top_speed_rad_s = in_rad(printed(95.0)),
              .torque_constant_Nm_A = printed(0.180),
              .rotor_inertia_kg_m2 = assumed(1.2e-4),
              .winding_resistance_Ohm = assumed(0.4),
              .gear_ratio = printed(120.0),
              .gear_inertia_kg_m2 = assumed(0.02),
              .gear_stiffness_Nm_rad = derived(30178.0),
              .friction_Nm = derived(13.99),
              .friction_viscous_Nms_rad = assumed(15.0),
              .spring_stiffness_Nm_rad = per_rad(printed(19.8)),
              .spring_half_gap_rad = in_rad(assumed(0.01)),
              .spring_asymmetry = assumed(0.0),
              .spring_friction_Nm = derived(0.957),
              .spring_load_friction = derived(0.0317),
              .spring_break_away_rad = kBreakAway,
              .bearing_friction_Nm = assumed(0.3),
              .torque_range_Nm = printed(200.0)},
    DataSheet{.name = "dfki-300",
              .title = "300 Nm series-elastic actuator",
              .rated_torque_Nm = printed(300.0),
              .rated_current_A = printed(11.0),
              .top_speed_rad_s = in_rad(printed(57.0)),
              .torque_constant_Nm_A = printed(0.210),
              .rotor_inertia_kg_m2 = assumed(3e-4),
              .winding_resistance_Ohm = assumed(0.25),
              .gear_ratio = printed(160.0),
              .gear_inertia_kg_m2 = assumed(0.04),
              .gear_stiffness_Nm_rad = derived(50094.0),
              .friction_Nm = derived(24.4),
              .friction_viscous_Nms_rad = assumed(60.0),
              .spring_stiffness_Nm_rad = per_rad(printed(39.3)),
              .spring_half_gap_rad = in_rad(assumed(0.01)),
              .spring_asymmetry = assumed(0.0),
              .spring_friction_Nm = assumed(2.4),
              .spring_load_friction = assumed(0.0317),
              .spring_break_away_rad = kBreakAway,
              .bearing_friction_Nm = assumed(0.6),
              .torque_range_Nm = assumed(400.0)},
};

}  // namespace

std::span<const DataSheet> data_sheets() noexcept { return kSheets; }

const DataSheet& data_sheet(std::string_view name) {
  const auto found = std::ranges::find(kSheets, name, &DataSheet::name);
  if (found != kSheets.end()) return *found;
  std::array<std::string_view, kSheets.size()> known;
  std::ranges::transform(kSheets, known.begin(), &DataSheet::name);
  throw UsageError({.place = "actuator",
                    .problem = "unknown name",
                    .expected = fmt::format("one of {}", fmt::join(known, ", ")),
                    .found = fmt::format("\"{}\"", name),
                    .advice = "torsio simulate --list shows them"});
}

}  // namespace torsio
