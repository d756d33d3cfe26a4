#pragma once

#include <optional>
#include <vector>

namespace torsio {

/// A larger ratio is not one of a gear.
inline constexpr double kLargestRatio = 400.0;

/// The angle of a motor as a multiple of the joint's, with what the spring between them adds:
/// motor = factor * joint + per_torque * torque + offset, by least squares.
struct GearFit {
  /// The share of the factor that the rest of the motor's motion can hide: what the fit leaves over
  /// what the joint moves without the torque. Where both move together, as at an elastic load, other
  /// factors fit as well.
  double doubt = 0.0;
  double doubt_of_torque = 0.0;  ///< the same of `per_torque`
  double together = 0.0;         ///< correlation of joint and torque
  double factor = 1.0;
  double error = 0.0;  ///< standard error of the factor; infinite if joint is a multiple of torque
  double explained = 0.0;  ///< share of the motor's variance, by joint and torque
  double by_joint = 0.0;   ///< the same by the joint without the torque
  /// Share of the variance that the torque leaves, explained by the joint.
  double by_joint_alone = 0.0;
  /// Its sign is that of the factor if the torque rises with the deflection.
  double per_torque = 0.0;
  double by_torque = 0.0;  ///< share of the variance that the joint leaves, explained by the torque
};
/// The columns of one log.
struct JointLog {
  std::vector<double> motor;
  std::vector<double> joint;
  std::vector<double> torque = {};  ///< empty: not used
};
/// One fit to all logs, with an offset for each: encoders may have another zero in each of them.
/// @returns nothing where the joint does not move or fewer than 50 rows have all numbers
[[nodiscard]] std::optional<GearFit> fit_gear(const std::vector<JointLog>& logs);

/// Whether the joint itself, and not only the torque, explains the motion of the motor. It does not
/// where the output is locked: the factor is that of the noise of a sensor.
[[nodiscard]] bool moves_with_joint(const GearFit& fit);

/// Whether the sign of the factor is certain.
[[nodiscard]] bool shows_sign(const GearFit& fit);

/// A ratio as gears are made: the next integer where the fit allows it, else four digits; 0 for a
/// factor of 0, or one that is not finite.
[[nodiscard]] double plausible_ratio(const GearFit& fit);

/// Whether each number is 0 or 1, and both occur.
[[nodiscard]] bool is_of_zeros_and_ones(const std::vector<double>& values);

/// Whether `values` change only in rows where the mask is 1, and in most of those.
[[nodiscard]] bool is_mask_of(const std::vector<double>& mask, const std::vector<double>& values);

/// Whether most rows are empty, and the others are not all at one end: a slower sensor.
[[nodiscard]] bool is_sparse(const std::vector<double>& values);

/// Median of the steps to the next row that are not 0; 0 if there is none.
[[nodiscard]] double usual_step(const std::vector<double>& values);

/// Whether no step is negative and most are positive.
[[nodiscard]] bool is_rising(const std::vector<double>& values);

[[nodiscard]] bool has_integers_only(const std::vector<double>& values);

}  // namespace torsio
