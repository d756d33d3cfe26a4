#pragma once

#include <string>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/joint_load/known_load.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// Gives every recording the torque of its known load as the dataset's target, and the standard error of each value as
/// `Dataset::target_error`:
///
///     T = gravity sin(q + zero) + inertia q''
///     error^2 = motion_error^2 + sum over the facts (d gravity sin(q + zero) + gravity cos(q + zero) d zero + d inertia q'')^2
///
/// q is joint_angle_rad, q'' the second derivative of a polynomial of order 4 over as many samples on either side as make
/// the error least that noise and lost bandwidth cause together, estimated from the recordings themselves. It looks ahead,
/// which only a target may. Where the polynomial does not reach, the target is NaN: not measured. How it was computed is in
/// `Dataset::load_target`.
///
/// Facts that the sheet fits are taken from `before`, where it has them, else estimated from the training recordings (all,
/// if none has that role): the values with which one simple spring, driven by the first input, explains all loads.
/// @param dataset loaded with `LoadOptions::computes_target`
/// @param before how the target of a model was computed that is compared with these recordings
/// @throws UsageError if the target is not a torque, or a recording already has such a channel; Error as `known_load`, if
/// joint_angle_rad is missing or jumps, or if the recordings do not determine what is fitted.
void add_load_target(Dataset& dataset, const LoadSheet& sheet, const FeatureSpec& features,
                     const LoadTarget& before = {});

/// What a user should know of it, in sentences: facts that were fitted, the width and the errors.
[[nodiscard]] std::vector<std::string> load_target_notes(const LoadTarget& target);

}  // namespace torsio
