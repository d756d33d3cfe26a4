#pragma once

#include <optional>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// The link that a single joint moves: a mass at the end of a lever, in addition to the inertia of the joint.
struct SingleLink {
  /// None: its weight needs `kDefaultWeightShare` of the rated torque.
  std::optional<double> mass_kg = {};
  double length_m = 0.3;
  bool has_vertical_axis = false;  ///< then gravity does not act
};

inline constexpr double kDefaultWeightShare = 0.25;
/// A single joint turns by this angle to either side.
inline constexpr double kSingleJointRange_rad = 2.8;

/// A joint without an arm, as an arm of one joint. With a horizontal axis the link hangs down at angle 0.
/// @throws UsageError for an actuator with a torsion tube before its last gear, which `JointController` does not control;
/// Error if mass or length is not positive, or the weight above `kLargestStaticShare` of the rated torque
[[nodiscard]] ArmSetup single_joint_setup(const DataSheet& sheet, const SingleLink& link = {});

}  // namespace torsio
