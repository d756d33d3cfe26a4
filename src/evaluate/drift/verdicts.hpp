#pragma once

#include "torsio/evaluate/drift.hpp"

namespace torsio {

namespace drift_names {
inline constexpr const char* kZero = "zero";
inline constexpr const char* kScale = "stiffness or gain";
inline constexpr const char* kStiffness = "stiffness";
inline constexpr const char* kGain = "gain of the torque sensor";
inline constexpr const char* kFriction = "friction";
}  // namespace drift_names

/// Sets change, interval and verdict of a quantity whose 95 % interval is `change` +- `half_width`.
void decide(DriftQuantity& of, double change, double half_width);

/// Verdict and advice from all quantities.
void conclude(Drift& drift);

/// Separates the gain g of the torque sensor from the relative change of the stiffness s: the spring shows
/// s + g, the reference g, as long as the twist of the gear or the torque constant has not changed.
/// The variances are added.
/// @param reference the same recordings against a model that does not use the spring.
void separate_gain(Drift& drift, const Drift& reference);

}  // namespace torsio
