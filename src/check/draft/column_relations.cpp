#include "check/draft/column_relations.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "numerics/quantile.hpp"

namespace torsio {
namespace {

constexpr std::size_t kFewestRows = 50;

/// The rows in which all numbers were measured.
struct KnownRows {
  Eigen::MatrixXd inputs;  ///< 1, joint and torque, if there is one
  Eigen::VectorXd motor;
};

/// Each column without its mean.
KnownRows known_rows(const JointLog& log) {
  const auto& [motor, joint, torque] = log;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < motor.size(); ++i)
    if (std::isfinite(motor[i]) && std::isfinite(joint[i]) &&
        (torque.empty() || std::isfinite(torque[i])))
      rows.push_back(i);
  KnownRows known{.inputs = Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(rows.size()),
                                                  torque.empty() ? 2 : 3),
                  .motor = Eigen::VectorXd(static_cast<Eigen::Index>(rows.size()))};
  for (Eigen::Index row = 0; row < known.motor.size(); ++row) {
    const std::size_t i = rows[static_cast<std::size_t>(row)];
    known.motor[row] = motor[i];
    known.inputs(row, 1) = joint[i];
    if (!torque.empty()) known.inputs(row, 2) = torque[i];
  }
  if (rows.empty()) return known;
  known.motor.array() -= known.motor.mean();
  for (Eigen::Index k = 1; k < known.inputs.cols(); ++k)
    known.inputs.col(k).array() -= known.inputs.col(k).mean();
  return known;
}

KnownRows known_rows(const std::vector<JointLog>& logs) {
  std::vector<KnownRows> parts;
  Eigen::Index rows = 0;
  for (const JointLog& log : logs) {
    parts.push_back(known_rows(log));
    rows += parts.back().motor.size();
  }
  KnownRows all{.inputs = Eigen::MatrixXd(rows, parts.front().inputs.cols()),
                .motor = Eigen::VectorXd(rows)};
  Eigen::Index row = 0;
  for (const KnownRows& part : parts) {
    all.inputs.middleRows(row, part.inputs.rows()) = part.inputs;
    all.motor.segment(row, part.motor.size()) = part.motor;
    row += part.motor.size();
  }
  return all;
}

/// What a fit leaves, and its coefficients.
struct Fitted {
  Eigen::VectorXd coefficients;
  double left = 0.0;
};

Fitted fitted(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& motor) {
  Fitted fit{.coefficients = inputs.colPivHouseholderQr().solve(motor)};
  fit.left = (motor - inputs * fit.coefficients).squaredNorm();
  return fit;
}

/// How far one of two inputs moves without the other: the norm of what the other does not explain.
double motion_alone(const Eigen::VectorXd& input, const Eigen::VectorXd& other) {
  const double squares = other.squaredNorm();
  if (!(squares > 0.0)) return input.norm();
  const double alone = (input - input.dot(other) / squares * other).norm();
  constexpr double kRounding = 1e-12;
  return alone > kRounding * input.norm() ? alone : 0.0;
}

/// What the fit leaves over what one of two inputs moves without the other.
double doubt_of(const Fitted& fit, Eigen::Index coefficient, double alone) {
  const double moved = std::abs(fit.coefficients[coefficient]) * alone;
  return moved > 0.0 ? std::sqrt(fit.left) / moved : HUGE_VAL;
}

/// The standard error of a factor: the residuals over the motion that only this input has.
double error_of(const Fitted& fit, double alone, std::size_t rows, std::size_t parameters) {
  if (!(alone > 0.0) || rows <= parameters) return HUGE_VAL;
  return std::sqrt(fit.left / static_cast<double>(rows - parameters)) / alone;
}

double width(const Eigen::VectorXd& values) { return values.maxCoeff() - values.minCoeff(); }

}  // namespace

std::optional<GearFit> fit_gear(const std::vector<JointLog>& logs) {
  if (logs.empty()) return std::nullopt;
  const KnownRows known = known_rows(logs);
  const auto rows = static_cast<std::size_t>(known.motor.size());
  if (rows < kFewestRows || !(width(known.inputs.col(1)) > 0.0) || !(width(known.motor) > 0.0))
    return std::nullopt;
  const Fitted with_joint = fitted(known.inputs.leftCols(2), known.motor);
  const bool has_torque = known.inputs.cols() == 3 && width(known.inputs.col(2)) > 0.0;
  const Fitted fit = has_torque ? fitted(known.inputs, known.motor) : with_joint;
  const double variance = (known.motor.array() - known.motor.mean()).square().sum();
  GearFit gear{.factor = fit.coefficients[1], .explained = 1.0 - fit.left / variance};
  const Eigen::VectorXd joint_values = known.inputs.col(1);
  const Eigen::VectorXd torque_values = has_torque ? Eigen::VectorXd(known.inputs.col(2))
                                                   : Eigen::VectorXd::Zero(joint_values.size());
  const double joint_alone = motion_alone(joint_values, torque_values);
  gear.error = error_of(fit, joint_alone, rows, logs.size() + (has_torque ? 2 : 1));
  gear.doubt = doubt_of(fit, 1, joint_alone);
  gear.by_joint = 1.0 - with_joint.left / variance;
  if (has_torque) {
    const Eigen::VectorXd per_torque =
        known.inputs.col(2) * (torque_values.dot(known.motor) / torque_values.squaredNorm());
    const double left_by_torque = (known.motor - per_torque).squaredNorm();
    gear.by_joint_alone = left_by_torque > 0.0 ? 1.0 - fit.left / left_by_torque : 0.0;
    gear.doubt_of_torque = doubt_of(fit, 2, motion_alone(torque_values, joint_values));
    gear.together = joint_values.dot(torque_values) / (joint_values.norm() * torque_values.norm());
    gear.per_torque = fit.coefficients[2];
    gear.by_torque = with_joint.left > 0.0 ? 1.0 - fit.left / with_joint.left : 0.0;
  }
  return gear;
}

bool moves_with_joint(const GearFit& fit) {
  constexpr double kMoves = 0.5;
  if (fit.by_joint >= kMoves) return true;
  return fit.by_joint_alone >= kMoves && shows_sign(fit);
}

bool shows_sign(const GearFit& fit) {
  constexpr double kErrors = 5.0;
  return std::abs(fit.factor) > kErrors * fit.error;
}

double plausible_ratio(const GearFit& fit) {
  constexpr double kNear = 0.003;
  constexpr double kErrors = 3.0;
  const double ratio = std::abs(fit.factor);
  if (!(ratio > 0.0) || !std::isfinite(ratio)) return 0.0;
  const double whole = std::round(ratio);
  if (whole >= 1.0 && std::abs(ratio - whole) <= std::max(kNear * ratio, kErrors * fit.error))
    return whole;
  const double digits = std::pow(10.0, 3.0 - std::floor(std::log10(ratio)));
  return std::round(ratio * digits) / digits;
}

bool is_of_zeros_and_ones(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double x) { return x == 0.0 || x == 1.0; }) &&
         std::ranges::find(values, 0.0) != values.end() &&
         std::ranges::find(values, 1.0) != values.end();
}

bool is_mask_of(const std::vector<double>& mask, const std::vector<double>& values) {
  constexpr double kMost = 0.8;
  std::size_t marked = 0;
  std::size_t changes = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const bool is_change = values[i] != values[i - 1] && std::isfinite(values[i]);
    if (is_change && mask[i] == 0.0) return false;
    if (mask[i] != 0.0) ++marked;
    if (is_change) ++changes;
  }
  return marked > 2 && static_cast<double>(changes) >= kMost * static_cast<double>(marked);
}

bool is_sparse(const std::vector<double>& values) {
  constexpr double kFewRows = 0.6;
  const auto is_measured = [](double x) { return std::isfinite(x); };
  const auto measured = std::ranges::count_if(values, is_measured);
  const auto first_half = std::count_if(
      values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), is_measured);
  return measured > 4 &&
         static_cast<double>(measured) < kFewRows * static_cast<double>(values.size()) &&
         3 * first_half > measured && 3 * (measured - first_half) > measured;
}

double usual_step(const std::vector<double>& values) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (const double step = values[i] - values[i - 1]; step != 0.0 && std::isfinite(step))
      steps.push_back(std::abs(step));
  return steps.empty() ? 0.0 : quantile(std::move(steps), 0.5);
}

bool is_rising(const std::vector<double>& values) {
  if (values.size() < 3) return false;
  std::size_t rises = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (!(values[i] >= values[i - 1])) return false;
    if (values[i] > values[i - 1]) ++rises;
  }
  return 10 * rises >= values.size();  // coarse stamps repeat
}

bool has_integers_only(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double x) { return std::isnan(x) || x == std::round(x); });
}

}  // namespace torsio
