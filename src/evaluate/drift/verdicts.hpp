#pragma once

#include <cstddef>
#include <string>

#include "evaluate/drift/direction_fit.hpp"
#include "torsio/evaluate/drift.hpp"

namespace torsio {

namespace drift_names {
inline constexpr const char* kZero = "zero";
inline constexpr const char* kScale = "stiffness or gain";
inline constexpr const char* kStiffness = "stiffness";
inline constexpr const char* kGain = "gain of the torque sensor";
inline constexpr const char* kFriction = "friction";
inline constexpr const char* kAsymmetry = "asymmetry";
inline constexpr const char* kBreakAway = "break-away angles";
inline constexpr const char* kDriveFriction = "friction of the drive";
}  // namespace drift_names

/// Half of a 95 % interval: both parts are added in quadrature.
struct DriftHalfWidth {
  double noise = 0.0;  ///< falls with the square root of the length of the recordings
  double model = 0.0;  ///< the share that the error of the model causes
  /// False: the model's falls with the fourth root, as a `LastingError` that noise hides.
  bool model_lasts = true;

  [[nodiscard]] double all() const noexcept;
};

/// Sets change, interval and verdict of a quantity whose 95 % interval is `change` +- `half_width`; where it is
/// undetermined, what would determine it.
void decide(DriftQuantity& of, double change, const DriftHalfWidth& half_width);

/// The quantity whose change is the coefficient of a column, with its verdict. The 95 % interval contains the
/// standard error and the error that the model itself may have in this direction.
/// @param before value of the model: coefficient, `tolerance` and `smallest` are relative to it; NaN: they are
/// in `unit`
[[nodiscard]] DriftQuantity direction_quantity(std::string of, std::string unit, double before,
                                               const DirectionFit& fit, std::size_t column,
                                               const LastingError& model_error, double tolerance,
                                               double smallest);

/// Verdict and advice from all quantities.
void conclude(Drift& drift);

/// Makes the scale of a reference undetermined. A friction that the reference does not contain acts like a gain.
void distrust_scale(Drift& reference, const std::string& reason);

/// Separates the gain g of the torque sensor from the relative change of the stiffness s: the spring shows
/// s + g, the reference g, as long as the twist of the gear or the torque constant has not changed.
/// The variances are added.
/// @param reference the same recordings against a model that does not use the spring.
void separate_gain(Drift& drift, const Drift& reference);

}  // namespace torsio
