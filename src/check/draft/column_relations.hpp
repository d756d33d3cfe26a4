#pragma once

#include <optional>
#include <vector>

namespace torsio {

/// The angle of a motor as a multiple of the joint's, with what the spring between them adds:
/// motor = factor * joint + per_torque * torque + offset, by least squares.
struct GearFit {
  /// The share of the factor that the rest of the motor's motion can hide: what the fit leaves over what the joint moves
  /// without the torque. Where both move together, as at an elastic load, other factors fit as well.
  double doubt = 0.0;
  double doubt_of_torque = 0.0;  ///< the same of `per_torque`
  double together = 0.0;         ///< correlation of joint and torque
  double factor = 1.0;
  double error = 0.0;      ///< standard error of the factor
  double explained = 0.0;  ///< share of the motor's variance
  double per_torque =
      0.0;  ///< its sign is that of the factor if the torque rises with the deflection
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

/// A ratio as gears are made: the next integer where the fit allows it, else four digits.
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
