#pragma once

#include <vector>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// How the resistance of copper rises with its temperature, over its value at 20 degrees Celsius.
inline constexpr double kCopperResistanceRise_1_K = 0.00393;

/// The electrical and thermal side of an actuator's motor, SI. Of these numbers the papers print only
/// the 30 kHz of the modulation (001): the rest is assumed by the rules below, before any simulation.
/// The 40 V and 69 A up to which the electronics of paper 003 work (section 2) are not among them.
struct ElectricalSheet {
  SheetValue pole_pairs;            ///< as the order of the torque ripple, six times this
  SheetValue phase_resistance_Ohm;  ///< `kPhaseResistanceShare` of the sheet's
  SheetValue phase_inductance_H;    ///< resistance times 1 ms
  SheetValue pwm_Hz;
  SheetValue bandwidth_rad_s;        ///< current loop: 1 / the time constant of the sheet
  SheetValue trip_current_A;         ///< 1.5 times the peak
  SheetValue current_offset_A;       ///< phase a, its negative in b: 0.2 % of the peak
  SheetValue current_gain_error;     ///< phase a, its negative in b: 0.5 %
  SheetValue current_noise_A;        ///< the sheet's
  SheetValue commutation_error_rad;  ///< electrical: 1 degree
  /// The rated current at 20 degrees Celsius around it warms the copper by 100 K. Of this, the step
  /// from copper to stator is 30 % with a time constant of 10 s, that from the stator 600 s.
  SheetValue copper_J_K;
  SheetValue stator_J_K;
  SheetValue copper_stator_K_W;
  SheetValue stator_ambient_K_W;
  SheetValue derating_begins_K;  ///< temperature of the stator: 80 degrees Celsius
  SheetValue derating_ends_K;    ///< no current any more; 100 degrees Celsius
};

[[nodiscard]] ElectricalSheet electrical_sheet(const DataSheet& sheet);

/// Every number of the sheet, in the order above.
[[nodiscard]] std::vector<SheetRow> describe(const ElectricalSheet& sheet);

/// The holding brake on the rotor of an actuator, SI. Paper 000 prints the manufacturer and the
/// activation voltage (Table 2) and nothing else: the rest is assumed by the rules below, before any
/// simulation.
struct BrakeSheet {
  /// 24 V for dfki-50. Of the "10/12" that the table prints for the others, the higher one; without
  /// a paper 24 V.
  SheetValue activation_V;
  SheetValue static_torque_Nm;  ///< referred to the joint: twice its rated torque
  SheetValue sliding_ratio;     ///< over the static torque: 0.8
  SheetValue bristle_rad;       ///< break-away angle of the rotor: 0.02
  SheetValue stribeck_rad_s;    ///< speed of the rotor: 3
  SheetValue engage_s;          ///< from the loss of the voltage to the torque: 20 ms
  SheetValue release_s;         ///< from the voltage to no torque: 40 ms
};

[[nodiscard]] BrakeSheet brake_sheet(const DataSheet& sheet);

/// Every number of the sheet, in the order above.
[[nodiscard]] std::vector<SheetRow> describe(const BrakeSheet& sheet);

}  // namespace torsio
