#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "actuator/sheet_values.hpp"
#include "torsio/actuator/data_sheet.hpp"

// What the values of a data sheet in a file must be.

namespace torsio::sheet_rules {

using Names = std::span<const std::string_view>;

inline constexpr std::array<std::pair<std::string_view, ActuatorFamily>, 4> kFamilies = {{
    {"series-elastic", ActuatorFamily::series_elastic},
    {"elastomer", ActuatorFamily::elastomer},
    {"rubber-clutch", ActuatorFamily::rubber_clutch},
    {"harmonic-drive", ActuatorFamily::harmonic_drive},
}};

inline constexpr auto kMayBeNegative = std::to_array<std::string_view>(
    {"spring_asymmetry", "rubber_asymmetry", "gear_error_2_phase", "gear_error_4_phase",
     "coupling_output_1", "coupling_output_2", "coupling_output_3", "motor_encoder_zero",
     "middle_encoder_zero", "joint_encoder_zero", "twist_sensor_zero"});
inline constexpr std::array<std::string_view, 34> kMustBePositive = {"rated_torque",
                                                                     "rated_current",
                                                                     "top_speed",
                                                                     "torque_constant",
                                                                     "rotor_inertia",
                                                                     "winding_resistance",
                                                                     "supply",
                                                                     "peak_current_ratio",
                                                                     "current_time_constant",
                                                                     "gear_ratio",
                                                                     "gear_stiffness",
                                                                     "gear_break_away",
                                                                     "tube_ratio",
                                                                     "tube_stiffness",
                                                                     "clutch_ratio",
                                                                     "cable_stiffness",
                                                                     "clutch_static_torque",
                                                                     "clutch_sliding_ratio",
                                                                     "friction_stribeck",
                                                                     "friction_bristle",
                                                                     "middle_inertia",
                                                                     "spring_stiffness",
                                                                     "spring_knee",
                                                                     "spring_stribeck",
                                                                     "coupling_stiffness",
                                                                     "coupling_slip_load",
                                                                     "rubber_stiffness",
                                                                     "rubber_blend",
                                                                     "rubber_slip",
                                                                     "output_inertia",
                                                                     "bearing_break_away",
                                                                     "torque_sensor_range",
                                                                     "torque_sensor_rate",
                                                                     "log_rate"};
// What a table of the torque curve replaces.
inline constexpr auto kReplacedByCurve = std::to_array<std::string_view>(
    {"spring_stage", "spring_stage_stiffness", "spring_half_gap", "spring_asymmetry"});

inline bool has(Names names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// The values of a sheet that its file has in its map, in order.
template <class Sheet, class Visit>
void visit_listed_values(Sheet& sheet, bool has_curve, const Visit& visit) {
  visit_values(sheet, [&](const std::string& name, std::string_view unit, auto& value) {
    if (name.starts_with("spring_curve_") || (has_curve && has(kReplacedByCurve, name))) return;
    visit(name, unit, value);
  });
}

inline bool has_curve(const DataSheet& sheet) {
  const auto* const spring = std::get_if<SpringSheet>(&sheet.second);
  return spring != nullptr && !spring->curve.empty();
}

}  // namespace torsio::sheet_rules
