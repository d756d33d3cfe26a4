#include "torsio/fit/redundancy/fit_motor_referenced_torques.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <vector>

#include "fit/common/finite_input.hpp"
#include "fit/redundancy/block_bootstrap.hpp"
#include "numerics/least_squares.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/signal/differentiator.hpp"

namespace torsio {
namespace {

constexpr std::size_t kColumns = 4;
constexpr std::size_t kLeastSamples = 5 * kColumns;
constexpr std::size_t kLeastResamples = 100;
constexpr double kRounding = 1e-12;  // share of the torque below which a residual is rounding

using Square = Eigen::Matrix<double, kColumns, kColumns>;

void check(const TorqueRegressionOptions& options) {
  if (options.resamples < kLeastResamples)
    throw UsageError({.place = "resamples",
                      .expected = fmt::format("at least {}", kLeastResamples),
                      .found = fmt::format("{}", options.resamples)});
}

void check(const TorqueRegressionData& data) {
  const std::size_t samples = data.motor_Nm.size();
  if (data.deflection_rad.size() != samples || data.joint_speed_rad_s.size() != samples)
    throw UsageError({.place = data.name,
                      .expected = "deflection, speed and motor torque of equal length",
                      .found = fmt::format("{}, {} and {} samples", data.deflection_rad.size(),
                                           data.joint_speed_rad_s.size(), samples)});
  if (!(data.sample_rate_Hz > 0.0) || !std::isfinite(data.sample_rate_Hz))
    throw UsageError({.place = data.name,
                      .expected = "a positive sample rate",
                      .found = fmt::format("{} Hz", data.sample_rate_Hz)});
  if (samples < kLeastSamples)
    throw Error({.place = data.name,
                 .problem = "too few samples for the torque regression",
                 .expected = fmt::format("at least {}, 5 for each coefficient", kLeastSamples),
                 .found = fmt::format("{}", samples),
                 .advice = "Record a trajectory that loads the joint in both directions."});
  for (std::size_t n = 0; n < samples; ++n)
    if (!std::isfinite(data.deflection_rad[n]) || !std::isfinite(data.joint_speed_rad_s[n]) ||
        !std::isfinite(data.motor_Nm[n]))
      throw Error({.place = fmt::format("{}: sample {}", data.name, n),
                   .expected = "finite deflection, speed and motor torque",
                   .found = fmt::format("{} rad, {} rad/s and {} Nm", data.deflection_rad[n],
                                        data.joint_speed_rad_s[n], data.motor_Nm[n]),
                   .advice = "Cut the record there."});
}

Matrix design_of(const TorqueRegressionData& data) {
  Matrix design(data.motor_Nm.size(), kColumns);
  for (std::size_t n = 0; n < design.rows; ++n) {
    design(n, 0) = 1.0;
    design(n, 1) = data.deflection_rad[n];
    design(n, 2) = data.joint_speed_rad_s[n];
    design(n, 3) = MotorReferencedTorques::coulomb_regressor(data.joint_speed_rad_s[n]);
  }
  return design;
}

[[noreturn]] void refuse_dependent(const TorqueRegressionData& data, std::size_t column) {
  static constexpr std::array<const char*, kColumns> kAdvice{
      "", "The deflection is constant: move the joint under a load that varies.",
      "The joint does not move: record it while it moves in both directions.",
      "The speed has too few values: record motions in both directions and at several speeds."};
  throw Error({.place = data.name,
               .problem = fmt::format("the record does not determine p{}", column),
               .expected = "columns 1, deflection, speed and atan(100 speed) that do not depend on "
                           "each other",
               .found = fmt::format("column {} is a combination of those before it", column + 1),
               .advice = kAdvice[column]});
}

/// R of design = basis R.
Square triangle(const Matrix& basis, const Matrix& design) {
  Square r = Square::Zero();
  for (std::size_t n = 0; n < design.rows; ++n)
    for (std::size_t i = 0; i < kColumns; ++i)
      for (std::size_t j = i; j < kColumns; ++j)
        r(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) += basis(n, i) * design(n, j);
  return r;
}

double condition_number(const Square& matrix) {
  const Eigen::JacobiSVD<Square> svd(matrix);
  return svd.singularValues()(0) / svd.singularValues()(kColumns - 1);
}

DeflectionTorque from_columns(const std::vector<double>& values) {
  return {values[0], values[1], values[2], values[3]};
}

Matrix inverse_of(const Square& r) {
  const Square inverse = r.triangularView<Eigen::Upper>().solve(Square::Identity());
  Matrix result(kColumns, kColumns);
  for (std::size_t i = 0; i < kColumns; ++i)
    for (std::size_t j = 0; j < kColumns; ++j)
      result(i, j) = inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  return result;
}

}  // namespace

DeflectionTorqueFit fit_deflection_torque(const TorqueRegressionData& data,
                                          const TorqueRegressionOptions& options) {
  check(options);
  check(data);
  const Matrix design = design_of(data);
  const LeastSquares solution = least_squares(design, data.motor_Nm);
  if (!solution.dropped.empty()) refuse_dependent(data, solution.dropped.front());
  std::vector<double> residual(design.rows);
  double squares = 0.0;
  double target_squares = 0.0;
  for (std::size_t n = 0; n < design.rows; ++n) {
    residual[n] = data.motor_Nm[n];
    for (std::size_t j = 0; j < kColumns; ++j)
      residual[n] -= solution.coefficients[j] * design(n, j);
    squares += residual[n] * residual[n];
    target_squares += data.motor_Nm[n] * data.motor_Nm[n];
  }
  const bool is_exact = squares <= kRounding * kRounding * target_squares;
  const Matrix basis = orthonormal_basis(design);
  const Square r = triangle(basis, design);
  const BlockBootstrap bootstrap =
      block_bootstrap(basis, residual, inverse_of(r), options.resamples, options.seed);
  const Square scaled = r * r.colwise().norm().cwiseInverse().asDiagonal();
  const Eigen::Vector4d per_degree(1.0, deg_from_rad(1.0), deg_from_rad(1.0), 1.0);
  return {
      .coefficients = from_columns(solution.coefficients),
      .standard_errors = is_exact ? DeflectionTorque{} : from_columns(bootstrap.standard_errors),
      .condition_number = condition_number(scaled),
      .unscaled_condition_number = condition_number(r * per_degree.asDiagonal()),
      .rmse_Nm = std::sqrt(squares / static_cast<double>(design.rows)),
      .effective_samples = bootstrap.effective_samples,
      .block_s = static_cast<double>(bootstrap.block_samples) / data.sample_rate_Hz};
}

MotorReferencedFit fit_motor_referenced_torques(const Recording& recording,
                                                double torque_constant_Nm_A, double gear_ratio,
                                                const TorqueRegressionOptions& options) {
  MotorReferencedFit fit{
      .parameters = {.torque_constant_Nm_A = torque_constant_Nm_A, .gear_ratio = gear_ratio},
      .gear = {},
      .spring = {}};
  static_cast<void>(MotorReferencedTorques(fit.parameters));  // checks constant and ratio
  const std::vector<double>& motor_rad = finite_input(recording, "motor_angle_rad");
  const std::vector<double>& gear_rad = finite_input(recording, "gear_angle_rad");
  const std::vector<double>& joint_rad = finite_input(recording, "joint_angle_rad");
  const std::vector<double>& current_A = finite_input(recording, "motor_current_A");
  Differentiator speed(recording.sample_rate_Hz(), options.speed_cutoff_Hz);
  std::vector<double> gear_deflection_rad;
  std::vector<double> spring_deflection_rad;
  std::vector<double> speed_rad_s;
  std::vector<double> motor_Nm;
  for (std::size_t n = 0; n < recording.size(); ++n) {
    const double joint_speed_rad_s = speed.step(joint_rad[n]);
    if (!speed.is_settled()) continue;
    const JointSample sample{.motor_angle_rad = motor_rad[n],
                             .gear_angle_rad = gear_rad[n],
                             .joint_angle_rad = joint_rad[n]};
    gear_deflection_rad.push_back(MotorReferencedTorques::gear_deflection(sample, gear_ratio));
    spring_deflection_rad.push_back(MotorReferencedTorques::spring_deflection(sample));
    speed_rad_s.push_back(joint_speed_rad_s);
    motor_Nm.push_back(torque_constant_Nm_A * gear_ratio * current_A[n]);
  }
  const auto fit_of = [&](const char* source, std::span<const double> deflection_rad) {
    return fit_deflection_torque({.name = fmt::format("{}, {}", recording.name(), source),
                                  .deflection_rad = deflection_rad,
                                  .joint_speed_rad_s = speed_rad_s,
                                  .motor_Nm = motor_Nm,
                                  .sample_rate_Hz = recording.sample_rate_Hz()},
                                 options);
  };
  fit.gear = fit_of("gear deflection", gear_deflection_rad);
  fit.spring = fit_of("spring deflection", spring_deflection_rad);
  fit.parameters.gear = fit.gear.coefficients;
  fit.parameters.spring = fit.spring.coefficients;
  return fit;
}

}  // namespace torsio
