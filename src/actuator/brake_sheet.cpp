#include "torsio/actuator/electrical_sheet.hpp"

namespace torsio {
namespace {

SheetValue activation_V(const DataSheet& sheet) {
  if (sheet.name == "dfki-50") return printed(24.0);
  return sheet.family == ActuatorFamily::series_elastic ? printed(12.0) : assumed(24.0);
}

}  // namespace

BrakeSheet brake_sheet(const DataSheet& sheet) {
  return {.activation_V = activation_V(sheet),
          .static_torque_Nm = assumed(2.0 * sheet.rating.torque_Nm.value),
          .sliding_ratio = assumed(0.8),
          .bristle_rad = assumed(0.02),
          .stribeck_rad_s = assumed(3.0),
          .engage_s = assumed(0.02),
          .release_s = assumed(0.04)};
}

std::vector<SheetRow> describe(const BrakeSheet& sheet) {
  return {{"brake_activation", "V", sheet.activation_V},
          {"brake_static_torque", "Nm", sheet.static_torque_Nm},
          {"brake_sliding_ratio", "", sheet.sliding_ratio},
          {"brake_break_away", "rad", sheet.bristle_rad},
          {"brake_stribeck", "rad/s", sheet.stribeck_rad_s},
          {"brake_engagement", "s", sheet.engage_s},
          {"brake_release", "s", sheet.release_s}};
}

}  // namespace torsio
