#include "torsio/arm/cartesian_impedance.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "arm/vector3.hpp"
#include "core/checks.hpp"

namespace torsio {
namespace {

constexpr auto kImpedancePlace = "cartesian impedance";
constexpr double kDampedShare = 1e-3;  // part of the most mobile axis that is added to each
constexpr double kLength_m = 0.5;      // makes rotations and translations comparable
constexpr double kRounding = 1e-12;

/// A rotation by nearly half a revolution: the axis is the largest column of R + Rᵀ + (1 − tr R) 1.
Vector3 half_turn_axis(const Matrix3& r) noexcept {
  const double trace = r[0] + r[4] + r[8];
  const Matrix3 outer = {2.0 * r[0] + 1.0 - trace, r[1] + r[3], r[2] + r[6], r[1] + r[3],
                         2.0 * r[4] + 1.0 - trace, r[5] + r[7], r[2] + r[6], r[5] + r[7],
                         2.0 * r[8] + 1.0 - trace};
  std::size_t largest = 0;
  for (std::size_t j = 1; j < 3; ++j)
    if (outer[4 * j] > outer[4 * largest]) largest = j;
  const Vector3 axis = column(outer, largest);
  return (1.0 / std::sqrt(dot(axis, axis))) * axis;
}

}  // namespace

Vector3 rotation_between(const Matrix3& from, const Matrix3& to) noexcept {
  const Matrix3 r = product(to, transposed(from));
  const Vector3 twice_sine = {r[7] - r[5], r[2] - r[6], r[3] - r[1]};
  const double sine = 0.5 * std::sqrt(dot(twice_sine, twice_sine));
  const double cosine = 0.5 * (r[0] + r[4] + r[8] - 1.0);
  const double angle_rad = std::atan2(sine, cosine);
  if (sine > 1e-6) return (0.5 * angle_rad / sine) * twice_sine;
  if (cosine > 0.0) return 0.5 * twice_sine;
  return std::numbers::pi * half_turn_axis(r);
}

CartesianImpedance::CartesianImpedance(const Settings& settings) : settings_(settings) {
  for (std::size_t axis = 0; axis < 6; ++axis) {
    require_not_negative(kImpedancePlace, "a stiffness", settings.stiffness[axis]);
    if (settings.stiffness[axis] > 0.0) rows_[count_++] = axis;
  }
  require_parameter(count_ > 0, kImpedancePlace, "at least one axis with a stiffness above 0", 0.0);
  require_not_negative(kImpedancePlace, "the damping ratio", settings.damping_ratio);
  require_not_negative(kImpedancePlace, "the stiffness of the posture",
                       settings.null_stiffness_Nm_rad);
  require_not_negative(kImpedancePlace, "the damping of the posture",
                       settings.null_damping_Nms_rad);
  require_positive(kImpedancePlace, "the largest force", settings.largest_force_N);
  require_positive(kImpedancePlace, "the largest moment", settings.largest_moment_Nm);
}

struct CartesianImpedance::Task {
  ArmDynamics::Jacobian jacobian;                 ///< all six rows
  ArmDynamics::JointMatrix mass;                  ///< factorised
  std::array<ArmDynamics::PerJoint, 6> weighted;  ///< rows of J M⁻¹, those of the task
  std::array<double, 36> mobility;                ///< J M⁻¹ Jᵀ of the task
  ArmFrame flange;
};

double CartesianImpedance::manipulability(const ArmDynamics::Jacobian& jacobian,
                                          std::size_t joints) const noexcept {
  std::array<double, 36> square;
  double largest = 0.0;
  const auto length = [this](std::size_t row) { return rows_[row] < 3 ? kLength_m : 1.0; };
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t k = 0; k < count_; ++k) {
      double sum = 0.0;
      for (std::size_t j = 0; j < joints; ++j)
        sum += jacobian[rows_[i] * joints + j] * jacobian[rows_[k] * joints + j];
      square[i * count_ + k] = sum / (length(i) * length(k));
    }
    largest = std::max(largest, square[i * count_ + i]);
  }
  for (std::size_t i = 0; i < count_; ++i) square[i * count_ + i] += kRounding * largest;
  if (!factor_positive(std::span(square).first(count_ * count_), count_)) return 0.0;
  double largest_inverse = 0.0;  // the factor has 1 over what is left of each axis
  for (std::size_t i = 0; i < count_; ++i)
    largest_inverse = std::max(largest_inverse, square[i * count_ + i]);
  return std::sqrt(1.0 / (largest * largest_inverse));
}

void CartesianImpedance::weigh(Task& task, std::size_t joints) const noexcept {
  const auto mass = std::span(task.mass).first(joints * joints);
  factor_positive(mass, joints);
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t j = 0; j < joints; ++j)
      task.weighted[i][j] = task.jacobian[rows_[i] * joints + j];
    solve_factored(mass, std::span(task.weighted[i]).first(joints));
  }
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t k = 0; k < count_; ++k) {
      double sum = 0.0;
      for (std::size_t j = 0; j < joints; ++j)
        sum += task.jacobian[rows_[i] * joints + j] * task.weighted[k][j];
      task.mobility[i * count_ + k] = sum;
    }
}

CartesianImpedance::PerAxis CartesianImpedance::wrench(const Task& task,
                                                       std::span<const double> speed_rad_s,
                                                       const ArmFrame& wanted) const noexcept {
  const Vector3 away_m = wanted.position_m - task.flange.position_m;
  const Vector3 away_rad = rotation_between(task.flange.rotation, wanted.rotation);
  PerAxis wrench = {};
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t axis = rows_[i];
    const double away = axis < 3 ? away_m[axis] : away_rad[axis - 3];
    const double limit = axis < 3 ? settings_.largest_force_N : settings_.largest_moment_Nm;
    const double mobility = task.mobility[i * count_ + i];
    const double mass = mobility > 0.0 ? 1.0 / mobility : 0.0;
    const double stiffness = settings_.stiffness[axis];
    double speed = 0.0;
    for (std::size_t j = 0; j < speed_rad_s.size(); ++j)
      speed += task.jacobian[axis * speed_rad_s.size() + j] * speed_rad_s[j];
    wrench[axis] = std::clamp(stiffness * away, -limit, limit) -
                   2.0 * settings_.damping_ratio * std::sqrt(stiffness * mass) * speed;
  }
  return wrench;
}

// Λ J M⁻¹ τ₀: the force at the flange that cancels what the posture does to it.
CartesianImpedance::PerAxis CartesianImpedance::cancelling(Task& task,
                                                           const ArmDynamics::PerJoint& posture_Nm,
                                                           std::size_t joints) const noexcept {
  // Damped by the most mobile axis of its kind, since an axis that cannot move has no mobility of its own.
  std::array<double, 2> most = {};
  const auto kind = [this](std::size_t row) { return rows_[row] < 3 ? 0U : 1U; };
  for (std::size_t i = 0; i < count_; ++i)
    most[kind(i)] = std::max(most[kind(i)], task.mobility[i * count_ + i]);
  for (std::size_t i = 0; i < count_; ++i)
    task.mobility[i * count_ + i] += kDampedShare * most[kind(i)];
  const auto mobility = std::span(task.mobility).first(count_ * count_);
  std::array<double, 6> force = {};
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t j = 0; j < joints; ++j) force[i] += task.weighted[i][j] * posture_Nm[j];
  factor_positive(mobility, count_);
  solve_factored(mobility, std::span(force).first(count_));
  return force;
}

CartesianImpedance::Output CartesianImpedance::step(const ArmDynamics& dynamics,
                                                    std::span<const double> angle_rad,
                                                    std::span<const double> speed_rad_s,
                                                    const Reference& reference) const noexcept {
  const std::size_t n = dynamics.size();
  Task task;
  Output output;
  task.flange = dynamics.jacobian(angle_rad, task.jacobian);
  dynamics.equation(angle_rad, speed_rad_s, task.mass, output.torque_Nm);  // c + g
  weigh(task, n);
  output.wrench = wrench(task, speed_rad_s.first(n), reference.flange);
  output.manipulability = manipulability(task.jacobian, n);
  output.is_singular = !(output.manipulability > kSingular);

  ArmDynamics::PerJoint posture_Nm = {};
  for (std::size_t j = 0; j < n; ++j)
    posture_Nm[j] = settings_.null_stiffness_Nm_rad * (reference.posture_rad[j] - angle_rad[j]) -
                    settings_.null_damping_Nms_rad * speed_rad_s[j];
  const PerAxis taken = cancelling(task, posture_Nm, n);
  for (std::size_t j = 0; j < n; ++j) {
    output.torque_Nm[j] += posture_Nm[j];
    for (std::size_t i = 0; i < count_; ++i)
      output.torque_Nm[j] += task.jacobian[rows_[i] * n + j] * (output.wrench[rows_[i]] - taken[i]);
  }
  return output;
}

}  // namespace torsio
