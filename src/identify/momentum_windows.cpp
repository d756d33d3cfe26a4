#include "identify/momentum_windows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "arm/vector3.hpp"
#include "identify/weighted_fit.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

/// A motion of a body or a momentum, about the origin of the base.
struct Spatial {
  Vector3 angular = {};
  Vector3 linear = {};
};

/// The unit inertia tensors in the order xx, yy, zz, xy, xz, yz, times a vector.
Vector3 unit_inertia_times(std::size_t entry, const Vector3& x) {
  switch (entry) {
    case 0: return {x[0], 0.0, 0.0};
    case 1: return {0.0, x[1], 0.0};
    case 2: return {0.0, 0.0, x[2]};
    case 3: return {x[1], x[0], 0.0};
    case 4: return {x[2], 0.0, x[0]};
    default: return {0.0, x[2], x[1]};
  }
}

/// Momentum and weight of a body of which one parameter is 1.
struct UnitBody {
  std::array<Spatial, kBodyParameters> momentum;
  std::array<Spatial, kBodyParameters> weight;

  UnitBody(const ArmFrame& frame, const Spatial& motion, const Vector3& gravity_m_s2) {
    const Vector3& o = frame.position_m;
    const Vector3& w = motion.angular;
    const Vector3 v = motion.linear + cross(w, o);
    momentum[0] = {cross(o, v), v};
    weight[0] = {cross(o, gravity_m_s2), gravity_m_s2};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3 c = column(frame.rotation, i);
      const Vector3 linear = cross(w, c);
      momentum[1 + i] = {cross(c, v) + cross(o, linear), linear};
      weight[1 + i] = {cross(c, gravity_m_s2), {}};
    }
    const Vector3 own = rotated_back(frame.rotation, w);
    for (std::size_t i = 0; i < 6; ++i) {
      momentum[4 + i] = {rotated(frame.rotation, unit_inertia_times(i, own)), {}};
      weight[4 + i] = {};
    }
  }
};

double product_of(const Spatial& motion, const Spatial& momentum) {
  return dot(motion.angular, momentum.angular) + dot(motion.linear, momentum.linear);
}

/// a x b of two motions.
Spatial cross_motion(const Spatial& a, const Spatial& b) {
  return {cross(a.angular, b.angular), cross(a.angular, b.linear) + cross(a.linear, b.angular)};
}

/// The state of a motion at one sample.
struct SampledMotion {
  const ArmMotion& motion;
  std::vector<std::vector<double>> speed_rad_s;

  void get(std::size_t sample, std::vector<double>& angle, std::vector<double>& speed) const {
    for (std::size_t j = 0; j < angle.size(); ++j) {
      angle[j] = motion.angle_rad[j][sample];
      speed[j] = speed_rad_s[j][sample];
    }
  }
};

}  // namespace

BodyParameters body_parameters(const BodyInertia& body) {
  BodyParameters of;
  const Vector3 moment = body.mass_kg * body.com_m;
  const Symmetric3 inertia =
      body.inertia_kg_m2 + 0.5 * body.mass_kg * inertia_of(body.com_m, body.com_m);
  of << body.mass_kg, moment[0], moment[1], moment[2], inertia[0], inertia[1], inertia[2],
      inertia[3], inertia[4], inertia[5];
  return of;
}

BodyInertia body_of(const BodyParameters& parameters) {
  BodyInertia body{.mass_kg = parameters(0)};
  if (body.mass_kg != 0.0)
    body.com_m = {parameters(1) / body.mass_kg, parameters(2) / body.mass_kg,
                  parameters(3) / body.mass_kg};
  const Symmetric3 shift = -0.5 * body.mass_kg * inertia_of(body.com_m, body.com_m);
  for (std::size_t i = 0; i < 6; ++i)
    body.inertia_kg_m2[i] = parameters(eigen_index(4 + i)) + shift[i];
  return body;
}

BodyJacobian parameters_by_body(const BodyInertia& body) {
  BodyJacobian by = BodyJacobian::Identity();
  const Symmetric3 of_mass = 0.5 * inertia_of(body.com_m, body.com_m);
  for (std::size_t i = 0; i < 3; ++i) {
    by(eigen_index(1 + i), 0) = body.com_m[i];
    by(eigen_index(1 + i), eigen_index(1 + i)) = body.mass_kg;
    Vector3 along = {};
    along[i] = 1.0;
    const Symmetric3 of_com = body.mass_kg * inertia_of(body.com_m, along);
    for (std::size_t k = 0; k < 6; ++k) by(eigen_index(4 + k), eigen_index(1 + i)) = of_com[k];
  }
  for (std::size_t k = 0; k < 6; ++k) by(eigen_index(4 + k), 0) = of_mass[k];
  return by;
}

MomentumColumns::MomentumColumns(std::size_t joints)
    : momentum(
          Eigen::MatrixXd::Zero(eigen_index(joints), kBodyParameters * eigen_index(joints + 1))),
      force(Eigen::MatrixXd::Zero(eigen_index(joints), kBodyParameters * eigen_index(joints + 1))) {
}

void MomentumColumns::set(const ArmModel& arm, const ArmDynamics& dynamics,
                          std::span<const double> angle_rad, std::span<const double> speed_rad_s) {
  const std::size_t joints = arm.joints.size();
  std::array<Spatial, kMaxArmJoints> axes;
  std::array<Spatial, kMaxArmJoints> turned;  // S x v
  Spatial motion;
  for (std::size_t k = 0; k < joints; ++k) {
    const ArmFrame frame = dynamics.link(k, angle_rad);
    const Vector3 axis = rotated(frame.rotation, arm.joints[k].axis);
    axes[k] = {axis, cross(frame.position_m, axis)};
    motion.angular = motion.angular + speed_rad_s[k] * axes[k].angular;
    motion.linear = motion.linear + speed_rad_s[k] * axes[k].linear;
    turned[k] = cross_motion(axes[k], motion);
    const std::size_t bodies = k + 1 == joints ? 2 : 1;
    for (std::size_t b = 0; b < bodies; ++b) {
      const UnitBody unit(b == 0 ? frame : product(frame, arm.flange), motion, dynamics.gravity());
      for (std::size_t p = 0; p < kBodyParameters; ++p) {
        const Eigen::Index column = kBodyParameters * eigen_index(k + b) + eigen_index(p);
        for (std::size_t j = 0; j <= k; ++j) {
          momentum(eigen_index(j), column) = product_of(axes[j], unit.momentum[p]);
          force(eigen_index(j), column) =
              product_of(axes[j], unit.weight[p]) - product_of(turned[j], unit.momentum[p]);
        }
      }
    }
  }
}

std::vector<double> centred_slope(std::span<const double> values, std::size_t half,
                                  double sample_rate_Hz) {
  std::vector<double> slope(values.size(), kNotMeasured);
  double squares = 0.0;
  for (std::size_t k = 1; k <= half; ++k) squares += 2.0 * static_cast<double>(k * k);
  for (std::size_t n = half; n + half < values.size(); ++n) {
    double sum = 0.0;
    for (std::size_t k = 1; k <= half; ++k)
      sum += static_cast<double>(k) * (values[n + k] - values[n - k]);
    slope[n] = sample_rate_Hz * sum / squares;
  }
  return slope;
}

namespace {

/// The rows of one motion.
class WindowsOfMotion {
 public:
  WindowsOfMotion(const ArmModel& arm, const ArmMotion& motion, const WindowSettings& settings)
      : arm_(arm),
        dynamics_(arm),
        sampled_{motion, {}},
        settings_(settings),
        half_(static_cast<std::size_t>(
            std::max(1.0, std::round(0.5 * settings.speed_window_s * motion.sample_rate_Hz)))),
        length_(static_cast<std::size_t>(
            std::max(2.0, std::round(settings.window_s * motion.sample_rate_Hz)))),
        columns_(arm.joints.size()),
        angle_(arm.joints.size()),
        speed_(arm.joints.size()) {
    for (const std::vector<double>& angle_rad : motion.angle_rad)
      sampled_.speed_rad_s.push_back(centred_slope(angle_rad, half_, motion.sample_rate_Hz));
  }

  [[nodiscard]] std::size_t count() const {
    const std::size_t samples = sampled_.motion.angle_rad.front().size();
    return samples <= 2 * half_ ? 0 : (samples - 2 * half_ - 1) / length_;
  }

  void add(std::size_t index, MomentumWindows& to, std::size_t first_window) {
    for (std::size_t w = 0; w < count(); ++w) {
      fill(half_ + w * length_, to, eigen_index((first_window + w) * arm_.joints.size()));
      to.motion[first_window + w] = index;
    }
  }

  /// Gravity in the frame of the flange, summed over the windows.
  [[nodiscard]] const Vector3& direction() const { return direction_; }

 private:
  void fill(std::size_t begin, MomentumWindows& to, Eigen::Index row) {
    const auto joints = eigen_index(arm_.joints.size());
    const double period_s = 1.0 / sampled_.motion.sample_rate_Hz;
    const double duration_s = period_s * static_cast<double>(length_);
    const Eigen::Index friction = to.friction_column();
    auto block = to.columns.middleRows(row, joints);
    for (std::size_t n = begin; n <= begin + length_; ++n) {
      const bool is_end = n == begin || n == begin + length_;
      const double weight = (is_end ? 0.5 : 1.0) * period_s / duration_s;
      sampled_.get(n, angle_, speed_);
      columns_.set(arm_, dynamics_, angle_, speed_);
      block.leftCols(friction) -= weight * columns_.force;
      if (is_end)
        block.leftCols(friction) += (n == begin ? -1.0 : 1.0) / duration_s * columns_.momentum;
      for (std::size_t j = 0; j < arm_.joints.size(); ++j) {
        to.torque_Nm(row + eigen_index(j)) += weight * sampled_.motion.torque_Nm[j][n];
        block(eigen_index(j), friction + eigen_index(2 * j)) +=
            weight * std::tanh(speed_[j] / settings_.friction_speed_rad_s);
        block(eigen_index(j), friction + eigen_index(2 * j + 1)) += weight * speed_[j];
        to.fastest_rad_s = std::max(to.fastest_rad_s, std::abs(speed_[j]));
      }
    }
    std::ranges::fill(speed_, 0.0);
    columns_.set(arm_, dynamics_, angle_, speed_);
    to.heaviest_Nm = std::max(to.heaviest_Nm,
                              columns_.force.col(to.body_column(to.joints)).cwiseAbs().maxCoeff());
    const Vector3& gravity = dynamics_.gravity();
    const double size = std::sqrt(dot(gravity, gravity));
    if (size > 0.0)
      direction_ =
          direction_ + 1.0 / size * rotated_back(dynamics_.flange(angle_).rotation, gravity);
  }

  const ArmModel& arm_;
  ArmDynamics dynamics_;
  SampledMotion sampled_;
  const WindowSettings& settings_;
  std::size_t half_;
  std::size_t length_;
  MomentumColumns columns_;
  std::vector<double> angle_;
  std::vector<double> speed_;
  Vector3 direction_ = {};
};

}  // namespace

MomentumWindows momentum_windows(const ArmModel& arm, std::span<const ArmMotion> motions,
                                 const WindowSettings& settings) {
  std::vector<WindowsOfMotion> all;
  all.reserve(motions.size());
  std::size_t count = 0;
  double longest_s = 0.0;
  for (const ArmMotion& motion : motions) {
    require_motion(motion, arm);
    count += all.emplace_back(arm, motion, settings).count();
    longest_s += static_cast<double>(motion.angle_rad.front().size()) / motion.sample_rate_Hz;
  }
  if (count < settings.least_windows)
    throw Error(
        {.place = motions.empty() ? arm.name : motions.front().name,
         .problem = "the motion is too short",
         .expected = fmt::format("at least {} windows of {:g} s, {:.3g} s", settings.least_windows,
                                 settings.window_s,
                                 static_cast<double>(settings.least_windows) * settings.window_s),
         .found = fmt::format("{:.3g} s", longest_s),
         .advice = "Record several moves: 'torsio arm excite' writes a program of them."});
  const std::size_t joints = arm.joints.size();
  MomentumWindows windows{.columns = {},
                          .torque_Nm = Eigen::VectorXd::Zero(eigen_index(count * joints)),
                          .joints = joints,
                          .motion = std::vector<std::size_t>(count),
                          .window_s = settings.window_s};
  windows.columns = Eigen::MatrixXd::Zero(eigen_index(count * joints),
                                          windows.friction_column() + eigen_index(2 * joints));
  std::size_t first = 0;
  for (std::size_t m = 0; m < all.size(); ++m) {
    all[m].add(m, windows, first);
    first += all[m].count();
    windows.mean_gravity_direction = windows.mean_gravity_direction + all[m].direction();
  }
  windows.mean_gravity_direction =
      1.0 / static_cast<double>(count) * windows.mean_gravity_direction;
  return windows;
}

}  // namespace torsio
