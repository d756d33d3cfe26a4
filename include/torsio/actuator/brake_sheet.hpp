#pragma once

#include <vector>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

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
