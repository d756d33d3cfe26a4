#pragma once

#include "torsio/design/report.hpp"
#include "torsio/design/tables.hpp"

namespace torsio {

/// A friction clutch that a stack of Belleville washers presses together. SI; paper 002 has the values
/// that are the defaults.
struct ClutchDemand {
  double slip_Nm = 0.5;
  double outer_m = 7.5e-3;  ///< radius of the lining
  double inner_m = 4.5e-3;  ///< radius of the lining
  double friction = 0.2;
  double least_friction = 0.1;
  double largest_friction = 0.25;
  int surfaces = 2;
  BellevilleWasher washer = {};
  int parallel = 1;  ///< washers on each other: force times this
  int series = 1;    ///< such packs against each other: travel times this
};

/// Slip torque over axial force [m] at uniform pressure: 2 μ Z (R0³ − R1³) / (3 (R0² − R1²)). Source:
/// 002 (5).
[[nodiscard]] double effective_arm(const ClutchDemand& demand, double friction);

/// Force, travel of the washers, spread of the slip torque over the friction, and how the bolt
/// adjusts it. A washer that is flat before the force is reached makes it infeasible.
/// @throws UsageError for values that are impossible.
[[nodiscard]] DesignReport design_clutch(const ClutchDemand& demand);

}  // namespace torsio
