#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "torsio/arm/arm_model.hpp"
#include "torsio/identify/identification.hpp"
#include "torsio/identify/identify_payload.hpp"

namespace torsio {

/// A link with its corrected mass, centre and inertia. A quantity whose standard error is above half of
/// the assumed deviation is not determined: it is, nearly, that of the model.
struct IdentifiedLink {
  std::string name = {};
  IdentifiedQuantity mass_kg = {};
  std::array<IdentifiedQuantity, 3> com_m = {};  ///< in the frame of the joint
  std::array<IdentifiedQuantity, 6> inertia_kg_m2 =
      {};  ///< xx, yy, zz, xy, xz, yz about the centre
  /// What was found is an inertia that no body has: the link of the model is kept in `IdentifiedLinks::arm`.
  bool is_impossible = false;
};

struct IdentifiedLinks {
  std::vector<IdentifiedLink> links = {};
  std::vector<IdentifiedJoint> joints = {};
  /// Friction of the joints if the links are those of the model: for comparison.
  std::vector<IdentifiedJoint> modelled_joints = {};
  ArmModel arm = {};  ///< with the corrected links
  IdentificationData data = {};
};

/// Corrections of the links' masses, centres and inertias, from the torques of a motion with a known payload
/// (`arm.payload`). Equations and standard errors are those of `identify_payload`; the prior of a link is the
/// model's value with the standard deviations `link_share` and `link_com_m` of the options, both above 0. Only combinations of
/// neighbouring links act on the torques (Gautier & Khalil 1990); the prior shares a change among them.
/// @throws Error as `identify_payload`; UsageError if a deviation is 0.
[[nodiscard]] IdentifiedLinks identify_links(const ArmModel& arm,
                                             std::span<const ArmMotion> motions,
                                             const IdentificationOptions& options);

/// How well the torques of other motions are those of an arm: RMS over the windows, one per joint [Nm], of the mean torque
/// that the motion needs, less the estimated one with the friction of `joints`.
/// @throws Error as `identify_payload`.
[[nodiscard]] std::vector<double> torque_residuals(const ArmModel& arm,
                                                   std::span<const IdentifiedJoint> joints,
                                                   std::span<const ArmMotion> motions,
                                                   const IdentificationOptions& options);

}  // namespace torsio
