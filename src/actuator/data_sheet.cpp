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

std::vector<SheetRow> describe(const DataSheet& sheet) {
  return {
      {"rated_torque", "Nm", sheet.rated_torque_Nm},
      {"rated_current", "A", sheet.rated_current_A},
      {"top_speed", "rad/s", sheet.top_speed_rad_s},
      {"torque_constant", "Nm/A", sheet.torque_constant_Nm_A},
      {"rotor_inertia", "kg m^2", sheet.rotor_inertia_kg_m2},
      {"winding_resistance", "Ohm", sheet.winding_resistance_Ohm},
      {"supply", "V", sheet.supply_V},
      {"peak_current_ratio", "", sheet.peak_current_ratio},
      {"current_time_constant", "s", sheet.current_time_constant_s},
      {"torque_ripple", "", sheet.torque_ripple},
      {"ripple_order", "", sheet.ripple_order},
      {"gear_ratio", "", sheet.gear_ratio},
      {"gear_inertia", "kg m^2", sheet.gear_inertia_kg_m2},
      {"gear_stiffness", "Nm/rad", sheet.gear_stiffness_Nm_rad},
      {"gear_damping_time", "s", sheet.gear_damping_time_s},
      {"gear_hysteresis", "rad", sheet.gear_hysteresis_rad},
      {"gear_break_away", "rad", sheet.gear_break_away_rad},
      {"gear_error_2_per_turn", "rad", sheet.gear_error_rad[0]},
      {"gear_error_4_per_turn", "rad", sheet.gear_error_rad[1]},
      {"gear_error_2_phase", "rad", sheet.gear_error_phase_rad[0]},
      {"gear_error_4_phase", "rad", sheet.gear_error_phase_rad[1]},
      {"friction", "Nm", sheet.friction_Nm},
      {"friction_viscous", "Nms/rad", sheet.friction_viscous_Nms_rad},
      {"friction_load_factor", "", sheet.friction_load_factor},
      {"friction_static_ratio", "", sheet.friction_static_ratio},
      {"friction_stribeck", "rad/s", sheet.friction_stribeck_rad_s},
      {"friction_bristle", "rad", sheet.friction_bristle_rad},
      {"spring_stiffness", "Nm/rad", sheet.spring_stiffness_Nm_rad},
      {"spring_stage", "rad", sheet.spring_stage_rad},
      {"spring_stage_stiffness", "Nm/rad", sheet.spring_stage_stiffness_Nm_rad},
      {"spring_half_gap", "rad", sheet.spring_half_gap_rad},
      {"spring_asymmetry", "", sheet.spring_asymmetry},
      {"spring_friction", "Nm", sheet.spring_friction_Nm},
      {"spring_load_friction", "", sheet.spring_load_friction},
      {"spring_viscosity", "Nms/rad", sheet.spring_viscosity_Nms_rad},
      {"spring_slip_share_1", "", sheet.spring_slip_share[0]},
      {"spring_slip_share_2", "", sheet.spring_slip_share[1]},
      {"spring_slip_share_3", "", sheet.spring_slip_share[2]},
      {"spring_slip_share_4", "", sheet.spring_slip_share[3]},
      {"spring_break_away_1", "rad", sheet.spring_break_away_rad[0]},
      {"spring_break_away_2", "rad", sheet.spring_break_away_rad[1]},
      {"spring_break_away_3", "rad", sheet.spring_break_away_rad[2]},
      {"spring_break_away_4", "rad", sheet.spring_break_away_rad[3]},
      {"output_inertia", "kg m^2", sheet.output_inertia_kg_m2},
      {"bearing_friction", "Nm", sheet.bearing_friction_Nm},
      {"bearing_break_away", "rad", sheet.bearing_break_away_rad},
      {"joint_viscous", "Nms/rad", sheet.joint_viscous_Nms_rad},
      {"encoder_bits", "", sheet.encoder_bits},
      {"encoder_jitter", "LSB", sheet.encoder_jitter_lsb},
      {"current_noise", "A", sheet.current_noise_A},
      {"torque_sensor_range", "Nm", sheet.torque_range_Nm},
      {"torque_sensor_noise_share", "", sheet.torque_noise_share},
      {"torque_sensor_rate", "Hz", sheet.torque_rate_Hz},
      {"torque_sensor_latency", "s", sheet.torque_latency_s},
  };
}

const DataSheet& data_sheet(std::string_view name) {
  const auto* const found = std::ranges::find(kSheets, name, &DataSheet::name);
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
