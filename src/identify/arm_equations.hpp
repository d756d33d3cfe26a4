#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "identify/momentum_windows.hpp"
#include "identify/weighted_fit.hpp"
#include "torsio/arm/arm_model.hpp"
#include "torsio/identify/identification.hpp"
#include "torsio/identify/identify_payload.hpp"

namespace torsio {

/// What is expected of a body; without a covariance it is exact.
struct BodyPrior {
  BodyParameters mean = BodyParameters::Zero();
  std::optional<BodyJacobian> covariance = {};
};

/// @returns the prior of a body of which mass and inertia may be wrong by this share, and the centre by this distance
[[nodiscard]] BodyPrior body_prior(const BodyInertia& body, double share, double com_m);

/// The fit of bodies, friction and scales of an arm, and where its parameters are.
struct ArmFit {
  WeightedFit fit;
  /// The first parameter of each body; none if it is exact.
  std::vector<std::optional<Eigen::Index>> body = {};
  std::vector<IdentifiedJoint> joints = {};
  IdentificationData data = {};
};

/// @param bodies the links and the payload
[[nodiscard]] ArmFit fit_arm(const ArmModel& arm, const MomentumWindows& windows,
                             const std::vector<BodyPrior>& bodies,
                             const IdentificationOptions& options);

/// @throws UsageError that names an option that is out of range.
void require_possible(const IdentificationOptions& options, const ArmModel& arm);

}  // namespace torsio
