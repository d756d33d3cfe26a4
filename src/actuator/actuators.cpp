#include "actuators.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

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
constexpr std::array<std::string_view, 3> kSpringVariants = {"maxwell-slip", "bouc-wen", "lugre"};

// SPEC section 4.2. The winding resistance is assumed for motors of that class: it only bounds the
// current at high speed.
constexpr std::array<DataSheet, 4> kSheets = {
    DataSheet{
        .name = "dfki-28",
        .title = "28 Nm series-elastic actuator",
        .variants = kSpringVariants,
        .variant = kSpringVariants[0],
        .rating = {printed(28.0), printed(4.8), in_rad(printed(300.0))},
        .motor = {.torque_constant_Nm_A = printed(0.057),
                  .rotor_inertia_kg_m2 = assumed(2e-5),
                  .winding_resistance_Ohm = assumed(0.6)},
        .first = GearSheet{.ratio = printed(100.0), .stiffness_Nm_rad = assumed(4.7e3)},
        .friction = {.coulomb_Nm = derived(0.65), .viscous_Nms_rad = assumed(1.0)},
        .middle_inertia_kg_m2 = assumed(0.004),
        .second = SpringSheet{.stiffness_Nm_rad = per_rad(printed(5.6)),
                              .half_gap_rad = in_rad(assumed(0.03)),
                              .asymmetry = assumed(0.04),
                              .friction_Nm = assumed(0.76),
                              .load_friction = assumed(0.05),
                              .break_away_rad = kBreakAway},
        .joint = {.bearing_friction_Nm = assumed(0.1)},
        .sensors = {.torque_range_Nm = printed(50.0)},
    },
    DataSheet{
        .name = "dfki-50",
        .title = "50 Nm series-elastic actuator with a two-stage spring",
        .variants = kSpringVariants,
        .variant = kSpringVariants[0],
        .rating = {printed(50.0), printed(5.0), in_rad(printed(157.0))},
        .motor = {.torque_constant_Nm_A = derived(0.104),
                  .rotor_inertia_kg_m2 = assumed(6e-5),
                  .winding_resistance_Ohm = assumed(0.5)},
        .first = GearSheet{.ratio = printed(120.0), .stiffness_Nm_rad = assumed(1.6e4)},
        .friction = {.coulomb_Nm = assumed(6.0), .viscous_Nms_rad = assumed(10.0)},
        .middle_inertia_kg_m2 = assumed(0.01),
        .second = SpringSheet{.stiffness_Nm_rad = per_rad(printed(10.0)),
                              .stage_rad = in_rad(printed(5.0)),
                              .stage_stiffness_Nm_rad = per_rad(assumed(20.0)),
                              .half_gap_rad = in_rad(assumed(0.015)),
                              .asymmetry = assumed(0.03),
                              .friction_Nm = derived(1.36),
                              .load_friction = assumed(0.03),
                              .break_away_rad = kBreakAway},
        .joint = {.bearing_friction_Nm = assumed(0.2)},
        .sensors = {.torque_range_Nm = printed(50.0)},
    },
    DataSheet{
        .name = "dfki-120",
        .title = "120 Nm series-elastic actuator",
        .variants = kSpringVariants,
        .variant = kSpringVariants[0],
        .rating = {printed(120.0), printed(7.0), in_rad(printed(95.0))},
        .motor = {.torque_constant_Nm_A = printed(0.180),
                  .rotor_inertia_kg_m2 = assumed(1.2e-4),
                  .winding_resistance_Ohm = assumed(0.4)},
        .first = GearSheet{.ratio = printed(120.0), .stiffness_Nm_rad = derived(30178.0)},
        .friction = {.coulomb_Nm = derived(13.99), .viscous_Nms_rad = assumed(15.0)},
        .middle_inertia_kg_m2 = assumed(0.02),
        .second = SpringSheet{.stiffness_Nm_rad = per_rad(printed(19.8)),
                              .half_gap_rad = in_rad(assumed(0.01)),
                              .asymmetry = assumed(0.0),
                              .friction_Nm = derived(0.957),
                              .load_friction = derived(0.0317),
                              .break_away_rad = kBreakAway},
        .joint = {.bearing_friction_Nm = assumed(0.3)},
        .sensors = {.torque_range_Nm = printed(200.0)},
    },
    DataSheet{
        .name = "dfki-300",
        .title = "300 Nm series-elastic actuator",
        .variants = kSpringVariants,
        .variant = kSpringVariants[0],
        .rating = {printed(300.0), printed(11.0), in_rad(printed(57.0))},
        .motor = {.torque_constant_Nm_A = printed(0.210),
                  .rotor_inertia_kg_m2 = assumed(3e-4),
                  .winding_resistance_Ohm = assumed(0.25)},
        .first = GearSheet{.ratio = printed(160.0), .stiffness_Nm_rad = derived(50094.0)},
        .friction = {.coulomb_Nm = derived(24.4), .viscous_Nms_rad = assumed(60.0)},
        .middle_inertia_kg_m2 = assumed(0.04),
        .second = SpringSheet{.stiffness_Nm_rad = per_rad(printed(39.3)),
                              .half_gap_rad = in_rad(assumed(0.01)),
                              .asymmetry = assumed(0.0),
                              .friction_Nm = assumed(2.4),
                              .load_friction = assumed(0.0317),
                              .break_away_rad = kBreakAway},
        .joint = {.bearing_friction_Nm = assumed(0.6)},
        .sensors = {.torque_range_Nm = assumed(400.0)},
    },
};

}  // namespace

std::span<const DataSheet> data_sheets() noexcept { return kSheets; }

void set_variant(DataSheet& sheet, std::string_view variant) {
  sheet.variant = *std::ranges::find(sheet.variants, variant);
  const auto index = std::ranges::find(sheet.variants, variant) - sheet.variants.begin();
  if (auto* spring = std::get_if<SpringSheet>(&sheet.second))
    spring->variant = static_cast<SpringVariant>(index);
}

}  // namespace torsio
