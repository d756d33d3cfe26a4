#pragma once

#include <optional>
#include <span>

#include "evaluate/drift/compared_run.hpp"
#include "torsio/evaluate/drift.hpp"

namespace torsio {

/// The change of the friction of motor and gear, where the reference estimates the torque from the motor
/// current. While the drive slides with the speed w (at least a twentieth of its 95 % quantile),
///
///     y ~ a + b i - F0 sgn w + c dw/dt,          tau - y = a' + b' i - f F0 sgn w + c' dw/dt + noise
///
/// with the estimate y of the reference, the current i and the torque tau. F0 is the friction, referred to the
/// torque, that the reference contains at the loads of this motion, and f its relative change. The friction of a
/// lubricant falls by a sixth with 10 K, which is the tolerance; it is not a change of the joint.
/// @param runs the reference over the recordings of role test, in the order of the dataset
/// @returns nothing for a reference without a motor current among its inputs.
[[nodiscard]] std::optional<DriftQuantity> drive_friction(const ModelFile& reference,
                                                          const Dataset& dataset,
                                                          std::span<const ComparedRun> runs,
                                                          const DriftOptions& options);

}  // namespace torsio
