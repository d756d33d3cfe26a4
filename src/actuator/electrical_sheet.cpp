#include "torsio/actuator/electrical_sheet.hpp"

#include <algorithm>
#include <cmath>

#include "control/current_controller.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr double kElectricalTime_s = 1e-3;
constexpr double kAmbient_K = 293.15;
constexpr double kRise_K = 100.0;
constexpr double kCopperShare = 0.3;  // share of the rise between copper and stator
constexpr double kCopperTime_s = 10.0;
constexpr double kStatorTime_s = 600.0;

}  // namespace

ElectricalSheet electrical_sheet(const DataSheet& sheet) {
  const double rated_A = sheet.rating.current_A.value;
  const double peak_A = sheet.motor.peak_current_ratio.value * rated_A;
  const double resistance_Ohm = sheet.motor.winding_resistance_Ohm.value;
  const double phase_Ohm = kPhaseResistanceShare * resistance_Ohm;
  const double loss_W =
      resistance_Ohm * rated_A * rated_A * (1.0 + kCopperResistanceRise_1_K * kRise_K);
  const double rise_K_W = kRise_K / loss_W;
  const double copper_stator_K_W = kCopperShare * rise_K_W;
  const double stator_ambient_K_W = (1.0 - kCopperShare) * rise_K_W;
  return {.pole_pairs = assumed(std::max(1.0, std::round(sheet.motor.ripple_order.value / 6.0))),
          .phase_resistance_Ohm = {phase_Ohm, sheet.motor.winding_resistance_Ohm.origin},
          .phase_inductance_H = assumed(phase_Ohm * kElectricalTime_s),
          .pwm_Hz = sheet.name == "dfki-50" ? printed(30e3) : assumed(30e3),
          .bandwidth_rad_s = {1.0 / sheet.motor.current_time_constant_s.value,
                              sheet.motor.current_time_constant_s.origin},
          .trip_current_A = assumed(1.5 * peak_A),
          .current_offset_A = assumed(0.002 * peak_A),
          .current_gain_error = assumed(0.005),
          .current_noise_A = sheet.sensors.current_noise_A,
          .commutation_error_rad = assumed(rad_from_deg(1.0)),
          .copper_J_K = assumed(kCopperTime_s / copper_stator_K_W),
          .stator_J_K = assumed(kStatorTime_s / stator_ambient_K_W),
          .copper_stator_K_W = assumed(copper_stator_K_W),
          .stator_ambient_K_W = assumed(stator_ambient_K_W),
          .derating_begins_K = assumed(kAmbient_K + 60.0),
          .derating_ends_K = assumed(kAmbient_K + 80.0)};
}

std::vector<SheetRow> describe(const ElectricalSheet& sheet) {
  return {{"pole_pairs", "", sheet.pole_pairs},
          {"phase_resistance", "Ohm", sheet.phase_resistance_Ohm},
          {"phase_inductance", "H", sheet.phase_inductance_H},
          {"pwm", "Hz", sheet.pwm_Hz},
          {"current_bandwidth", "rad/s", sheet.bandwidth_rad_s},
          {"trip_current", "A", sheet.trip_current_A},
          {"current_offset", "A", sheet.current_offset_A},
          {"current_gain_error", "", sheet.current_gain_error},
          {"commutation_error", "rad", sheet.commutation_error_rad},
          {"copper_heat_capacity", "J/K", sheet.copper_J_K},
          {"stator_heat_capacity", "J/K", sheet.stator_J_K},
          {"copper_to_stator", "K/W", sheet.copper_stator_K_W},
          {"stator_to_ambient", "K/W", sheet.stator_ambient_K_W},
          {"derating_begins", "K", sheet.derating_begins_K},
          {"derating_ends", "K", sheet.derating_ends_K}};
}

}  // namespace torsio
