#pragma once

#include <string>
#include <vector>

#include "torsio/data/dataset.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// From the user's inputs to those of the model: the wanted input expressions with every definition
/// they need, so that the model's raw inputs are measured channels.
///
/// Definitions are those of the recordings' mapping and, unless recorded themselves, the canonical
/// ones (specification 0):
///
///     spring_deflection_rad = gear_angle_rad - joint_angle_rad
///     spring_deflection_rate_rad_s = rate(spring_deflection_rad)
///     joint_speed_rad_s = rate(joint_angle_rad)
///
/// Without wanted inputs: the dataset's first input set, else the deflection, its rate and
/// the joint speed, both filtered with 10 Hz or a fifth of a lower sample rate, as far as present.
/// @throws Error listing the channels if an input needs one that a record lacks, or no default
/// applies, or if two records define one name differently.
[[nodiscard]] FeatureSpec resolve_inputs(const Dataset& dataset,
                                         const std::vector<std::string>& wanted);

/// The first input at every sample of a recording, from a new pipeline; NaN where a raw channel is
/// not finite. Used for plots over "the input".
[[nodiscard]] std::vector<double> first_feature(const Recording& recording,
                                                const FeatureSpec& spec);

/// A raw input that the target was computed from, declared by the dataset or found in the data (the
/// target is a linear function of the input to 3e-5 of its spread), or all inputs if they give the
/// target only together; where the target is the torque of a known load, an input that has the angle or the acceleration of
/// one side of the spring by itself; empty if there is none. Such an input is a leak: a score with it means
/// nothing.
[[nodiscard]] std::string find_leak(const Dataset& dataset, const FeatureSpec& spec);

/// `find_leak`; if there is a leak and the user does not allow it, @throws UsageError.
std::string refuse_leak(const Dataset& dataset, const FeatureSpec& spec, bool allow_leak);

}  // namespace torsio
