#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "fleet/joint_trait.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/drift.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// The traits of a joint in all recordings of the dataset, whose role is test, against the model of its family.
/// @throws Error as `joint_difference`.
[[nodiscard]] JointTraits joint_traits(const ModelFile& base, const Dataset& dataset,
                                       const Progress& progress = {});

/// An error of an encoder that repeats with its angle: amplitude cos(periods angle + phase).
struct PeriodicError {
  double amplitude_rad = 0.0;
  std::string channel = {};  ///< angle with which it repeats
  std::size_t periods = 0;   ///< per turn
  double share = 0.0;        ///< part of the variance of the residual that it explains
};

/// The periodic error that explains most of a residual, over it divided by the stiffness:
///
///     e / k = c_0 + c_1 theta + c_2 theta^2 + a cos(N theta) + b sin(N theta)
///
/// for each angle channel in rad and N = 1 to 64 with 1.25 periods or more in the motion.
[[nodiscard]] PeriodicError periodic_error(const Drift& drift, const Dataset& dataset);

/// Wander of the mean residual from one change of the load's sign to the next, in the target's unit: a load cell that
/// is loose comes to rest in another place each time. It is the root mean square distance from the median of the means
/// with the same sign, without the fifth that is furthest from it: a model may be wrong in a few of the motions. NaN
/// with fewer than four means.
[[nodiscard]] double zero_wander(const Drift& drift);

}  // namespace torsio
