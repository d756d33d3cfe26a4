#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/estimate/motor_referenced_torques.hpp"

namespace torsio {

struct TorqueRegressionOptions {
  double speed_cutoff_Hz = 20.0;  ///< low-pass of q̇, the difference of the joint angle
  std::size_t resamples = 1000;   ///< drawn by the bootstrap, at least 100
  std::uint64_t seed = 1;         ///< seed of the bootstrap
};

/// The samples of one regression (16).
struct TorqueRegressionData {
  std::string name;                        ///< for messages
  std::span<const double> deflection_rad;  ///< Δq of gear or spring
  std::span<const double> joint_speed_rad_s;
  std::span<const double> motor_Nm;  ///< τ_mot, the reference
  double sample_rate_Hz = 0.0;
};

struct DeflectionTorqueFit {
  DeflectionTorque coefficients;
  /// One standard deviation of each coefficient; NaN if the record has less than 10 blocks, 0 if
  /// the residual is rounding.
  DeflectionTorque standard_errors = {kNotMeasured, kNotMeasured, kNotMeasured, kNotMeasured};
  double condition_number = kNotMeasured;  ///< condition number of (16) with columns of length 1
  /// The same without scaling, in the paper's units (1, deg, deg/s, rad).
  double unscaled_condition_number = kNotMeasured;
  double rmse_Nm = kNotMeasured;            ///< root mean square of the residual
  double effective_samples = kNotMeasured;  ///< N / (1 + 2 sum r_k) of the residual
  double block_s = kNotMeasured;            ///< length of a block of the bootstrap
};

/// Least squares of (16),
///
///     [1, Δq, q̇, atan(100 q̇)] p = τ_mot,
///
/// by QR with columns of length 1. The standard errors are those of a circular block bootstrap of
/// the rows (Politis and Romano 1992): neighbouring residuals are alike, so that errors for
/// independent samples are far too small. With N samples whose residuals have the autocorrelation
/// r_k, summed until it first is not above 0,
///
///     T = 1 + 2 Σ r_k,   L = (3/8 T² N)^(1/3)
///
/// is the length of a block [samples], the optimum for an autoregressive residual (Politis and
/// White 2004, with the constant of 2009). Two losses of such errors are corrected: the covariance
/// between blocks, Σ r_k k/L, and the four fitted coefficients out of N/T effective samples. They
/// contain noise and every part of the residual that varies along the record, not a systematic
/// error that all blocks have. Of more than 8192 samples at most 8192 sums over neighbours are
/// used, and L is a whole number of these. Deterministic for a seed.
///
/// @throws Error if there are fewer than 20 samples, numbers that are not finite, or a column that
/// depends on the ones before it (a joint at rest or a constant deflection); UsageError if the
/// lengths differ or an option is out of its range.
[[nodiscard]] DeflectionTorqueFit fit_deflection_torque(
    const TorqueRegressionData& data, const TorqueRegressionOptions& options = {});

struct MotorReferencedFit {
  MotorReferencedTorques::Parameters parameters;
  DeflectionTorqueFit gear;
  DeflectionTorqueFit spring;
};

/// Both regressions of one recording: τ_mot from `motor_current_A`, the deflections from
/// `motor_angle_rad`, `gear_angle_rad` and `joint_angle_rad`, q̇ by
/// `Differentiator(rate, speed_cutoff_Hz)` of `joint_angle_rad`, whose settling is left out. Give
/// `MotorReferencedTorques::step` the speed of the same differentiator.
/// @throws Error as `fit_deflection_torque`, if a channel is missing, or if torque constant or ratio
/// is not positive.
[[nodiscard]] MotorReferencedFit fit_motor_referenced_torques(
    const Recording& recording, double torque_constant_Nm_A, double gear_ratio,
    const TorqueRegressionOptions& options = {});

/// The coefficients of one joint of a robot.
struct JointTorqueCoefficients {
  std::string name;
  MotorReferencedTorques::Parameters parameters;

  bool operator==(const JointTorqueCoefficients&) const = default;
};

/// The coefficients as YAML, in SI; `parse_torque_coefficients` of it gives the same numbers, bit
/// for bit.
[[nodiscard]] std::string torque_coefficients_yaml(std::span<const JointTorqueCoefficients> joints);

/// Reads the coefficients of one or more joints. The keys state the units; p1 and p2 may be per
/// degree, as the paper prints them, or per radian. Signs: `MotorReferencedTorques`.
///
///     joints:
///       - name: "Joint 2, 300 Nm"
///         torque_constant_Nm_A: 0.210
///         gear_ratio: 160
///         spring: {p0_Nm: 10.876, p1_Nm_deg: -30.29, p2_Nms_deg: 2.3337, p3_Nm: 15.521}
///         gear: {p0_Nm: -149.0, p1_Nm_rad: -50094, p2_Nms_rad: 17.62, p3_Nm: 15.969}
///
/// @throws Error naming file, line, what was expected and found, if a value is missing, is not a
/// number, has a unit, is given per degree and per radian, if torque constant or ratio is not
/// positive, a key is not known or two joints have the same name; Cancelled.
[[nodiscard]] std::vector<JointTorqueCoefficients> read_torque_coefficients(
    const std::string& path, const Progress& progress = {});
/// The same from a text. @param file for messages
[[nodiscard]] std::vector<JointTorqueCoefficients> parse_torque_coefficients(
    std::string_view text, const std::string& file);

}  // namespace torsio
