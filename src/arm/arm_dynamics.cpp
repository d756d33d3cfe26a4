#include "torsio/arm/arm_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "arm/vector3.hpp"
#include "core/all_finite.hpp"

namespace torsio {
namespace {

/// A rotation that turns the z axis into this one of length 1.
Matrix3 from_z(const Vector3& axis) noexcept {
  // The unit vector that is farthest from the axis gives the best x axis.
  std::size_t least = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (std::abs(axis[i]) < std::abs(axis[least])) least = i;
  Vector3 other{};
  other[least] = 1.0;
  Vector3 x = cross(other, axis);
  x = (1.0 / std::sqrt(dot(x, x))) * x;
  const Vector3 y = cross(axis, x);
  return {x[0], y[0], axis[0], x[1], y[1], axis[1], x[2], y[2], axis[2]};
}

/// R Rz(q)
Matrix3 turned(const Matrix3& r, double sine, double cosine) noexcept {
  return {cosine * r[0] + sine * r[1], cosine * r[1] - sine * r[0], r[2],
          cosine * r[3] + sine * r[4], cosine * r[4] - sine * r[3], r[5],
          cosine * r[6] + sine * r[7], cosine * r[7] - sine * r[6], r[8]};
}

}  // namespace

/// The rotations of one state, each from a link's frame to that of the previous link.
struct ArmDynamics::Turned {
  std::array<Matrix3, kMaxArmJoints> rotation;
};

ArmDynamics::ArmDynamics(const ArmModel& arm)
    : count_(arm.joints.size()), payload_(arm.payload), gravity_m_s2_(arm.gravity_m_s2) {
  require_possible(arm);
  Matrix3 previous = kIdentity3;
  for (std::size_t i = 0; i < count_; ++i) {
    const ArmJoint& joint = arm.joints[i];
    to_joint_[i] = from_z(joint.axis);
    links_[i].origin = {
        rotated_back(previous, joint.origin.position_m),
        product(transposed(previous), product(joint.origin.rotation, to_joint_[i]))};
    set_body(links_[i], moved(joint.body, {{}, transposed(to_joint_[i])}));
    previous = to_joint_[i];
  }
  last_body_ = links_[count_ - 1].body;
  flange_ = product(ArmFrame{{}, transposed(previous)}, arm.flange);
  load_last();
}

void ArmDynamics::set_body(Link& link, const BodyInertia& body) noexcept {
  link.body = body;
  link.moment_kg_m = body.mass_kg * body.com_m;
  link.inertia_kg_m2 = body.inertia_kg_m2 + 0.5 * inertia_of(body.com_m, link.moment_kg_m);
}

void ArmDynamics::load_last() noexcept {
  set_body(links_[count_ - 1], together(last_body_, moved(payload_, flange_)));
}

bool ArmDynamics::set_payload(const BodyInertia& payload) noexcept {
  if (!is_possible_payload(payload)) return false;
  payload_ = payload;
  load_last();
  return true;
}

bool ArmDynamics::set_gravity(const Vector3& gravity_m_s2) noexcept {
  if (!all_finite(gravity_m_s2)) return false;
  gravity_m_s2_ = gravity_m_s2;
  return true;
}

void ArmDynamics::place(std::span<const double> angle_rad, Turned& at) const noexcept {
  for (std::size_t i = 0; i < count_; ++i)
    at.rotation[i] =
        turned(links_[i].origin.rotation, std::sin(angle_rad[i]), std::cos(angle_rad[i]));
}

// Outwards the motion of each link in its own frame, inwards the forces. Gravity is an acceleration of
// the base against it.
template <bool kMoves, bool kAccelerates>
void ArmDynamics::newton_euler(const Turned& at, const double* speed_rad_s,
                               const double* acceleration_rad_s2,
                               double* torque_Nm) const noexcept {
  std::array<Vector3, kMaxArmJoints> force;
  std::array<Vector3, kMaxArmJoints> moment;
  Vector3 w{};
  Vector3 dw{};
  Vector3 a = -1.0 * gravity_m_s2_;
  for (std::size_t i = 0; i < count_; ++i) {
    const Link& link = links_[i];
    const Matrix3& r = at.rotation[i];
    const Vector3& p = link.origin.position_m;
    if constexpr (kMoves || kAccelerates) a = a + cross(dw, p);
    if constexpr (kMoves) a = a + cross(w, cross(w, p));
    a = rotated_back(r, a);
    if constexpr (kMoves || kAccelerates) dw = rotated_back(r, dw);
    if constexpr (kMoves) {
      w = rotated_back(r, w);
      dw[0] += w[1] * speed_rad_s[i];
      dw[1] -= w[0] * speed_rad_s[i];
      w[2] += speed_rad_s[i];
    }
    if constexpr (kAccelerates) dw[2] += acceleration_rad_s2[i];
    const Vector3& h = link.moment_kg_m;
    force[i] = link.body.mass_kg * a;
    moment[i] = cross(h, a);
    if constexpr (kMoves || kAccelerates) {
      force[i] = force[i] + cross(dw, h);
      moment[i] = moment[i] + times(link.inertia_kg_m2, dw);
    }
    if constexpr (kMoves) {
      force[i] = force[i] + cross(w, cross(w, h));
      moment[i] = moment[i] + cross(w, times(link.inertia_kg_m2, w));
    }
  }
  for (std::size_t i = count_; i-- > 0;) {
    torque_Nm[i] = moment[i][2];
    if (i == 0) break;
    const Vector3 f = rotated(at.rotation[i], force[i]);
    force[i - 1] = force[i - 1] + f;
    moment[i - 1] =
        moment[i - 1] + rotated(at.rotation[i], moment[i]) + cross(links_[i].origin.position_m, f);
  }
}

// All links from a joint outwards are one body for a motion of that joint alone.
void ArmDynamics::composite(const Turned& at, double* mass_kg_m2) const noexcept {
  double mass_kg = 0.0;
  Vector3 h{};
  Symmetric3 inertia{};
  for (std::size_t i = count_; i-- > 0;) {
    const Link& link = links_[i];
    mass_kg += link.body.mass_kg;
    h = h + link.moment_kg_m;
    inertia = inertia + link.inertia_kg_m2;
    mass_kg_m2[i * count_ + i] = inertia[2];
    Vector3 f = {-h[1], h[0], 0.0};
    Vector3 n = {inertia[4], inertia[5], inertia[2]};
    for (std::size_t j = i; j-- > 0;) {
      f = rotated(at.rotation[j + 1], f);
      n = rotated(at.rotation[j + 1], n) + cross(links_[j + 1].origin.position_m, f);
      mass_kg_m2[i * count_ + j] = mass_kg_m2[j * count_ + i] = n[2];
    }
    if (i == 0) break;
    const Vector3& p = link.origin.position_m;
    h = rotated(at.rotation[i], h);
    inertia =
        rotated(at.rotation[i], inertia) + inertia_of(p, h) + 0.5 * mass_kg * inertia_of(p, p);
    h = h + mass_kg * p;
  }
}

void ArmDynamics::inverse(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                          std::span<const double> acceleration_rad_s2,
                          std::span<double> torque_Nm) const noexcept {
  Turned at;
  place(angle_rad, at);
  newton_euler<true, true>(at, speed_rad_s.data(), acceleration_rad_s2.data(), torque_Nm.data());
}

void ArmDynamics::gravity_torque(std::span<const double> angle_rad,
                                 std::span<double> torque_Nm) const noexcept {
  Turned at;
  place(angle_rad, at);
  newton_euler<false, false>(at, nullptr, nullptr, torque_Nm.data());
}

void ArmDynamics::mass_matrix(std::span<const double> angle_rad,
                              std::span<double> mass_kg_m2) const noexcept {
  Turned at;
  place(angle_rad, at);
  composite(at, mass_kg_m2.data());
}

void ArmDynamics::equation(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                           std::span<double> mass_kg_m2, std::span<double> bias_Nm) const noexcept {
  Turned at;
  place(angle_rad, at);
  newton_euler<true, false>(at, speed_rad_s.data(), nullptr, bias_Nm.data());
  composite(at, mass_kg_m2.data());
}

void ArmDynamics::forward(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                          std::span<const double> torque_Nm,
                          std::span<double> acceleration_rad_s2) const noexcept {
  JointMatrix mass_kg_m2;
  PerJoint bias_Nm;
  equation(angle_rad, speed_rad_s, mass_kg_m2, bias_Nm);
  for (std::size_t i = 0; i < count_; ++i) acceleration_rad_s2[i] = torque_Nm[i] - bias_Nm[i];
  // An arm of bodies with mass has a positive definite M; a state that is not finite has none.
  solve_positive(std::span(mass_kg_m2).first(count_ * count_), acceleration_rad_s2.first(count_));
}

void ArmDynamics::momentum(std::span<const double> angle_rad, std::span<const double> speed_rad_s,
                           std::span<double> momentum_Nms, std::span<double> energy_gradient_Nm,
                           std::span<double> gravity_Nm) const noexcept {
  Turned at;
  place(angle_rad, at);
  newton_euler<false, false>(at, nullptr, nullptr, gravity_Nm.data());
  std::array<Vector3, kMaxArmJoints> spin;
  std::array<Vector3, kMaxArmJoints> velocity;
  std::array<Vector3, kMaxArmJoints> linear;
  std::array<Vector3, kMaxArmJoints> angular;
  Vector3 w{};
  Vector3 v{};
  for (std::size_t i = 0; i < count_; ++i) {
    const Link& link = links_[i];
    v = rotated_back(at.rotation[i], v + cross(w, link.origin.position_m));
    w = rotated_back(at.rotation[i], w);
    w[2] += speed_rad_s[i];
    spin[i] = w;
    velocity[i] = v;
    linear[i] = link.body.mass_kg * v + cross(w, link.moment_kg_m);
    angular[i] = times(link.inertia_kg_m2, w) + cross(link.moment_kg_m, v);
  }
  for (std::size_t i = count_; i-- > 0;) {
    momentum_Nms[i] = angular[i][2];
    energy_gradient_Nm[i] = spin[i][1] * angular[i][0] - spin[i][0] * angular[i][1] +
                            velocity[i][1] * linear[i][0] - velocity[i][0] * linear[i][1];
    if (i == 0) break;
    const Vector3 p = rotated(at.rotation[i], linear[i]);
    linear[i - 1] = linear[i - 1] + p;
    angular[i - 1] = angular[i - 1] + rotated(at.rotation[i], angular[i]) +
                     cross(links_[i].origin.position_m, p);
  }
}

ArmFrame ArmDynamics::outwards(std::size_t joint,
                               std::span<const double> angle_rad) const noexcept {
  ArmFrame frame;
  for (std::size_t i = 0; i <= joint; ++i)
    frame = product(
        frame, {links_[i].origin.position_m,
                turned(links_[i].origin.rotation, std::sin(angle_rad[i]), std::cos(angle_rad[i]))});
  return frame;
}

ArmFrame ArmDynamics::flange(std::span<const double> angle_rad) const noexcept {
  return product(outwards(count_ - 1, angle_rad), flange_);
}

ArmFrame ArmDynamics::link(std::size_t joint, std::span<const double> angle_rad) const noexcept {
  return product(outwards(joint, angle_rad), {{}, transposed(to_joint_[joint])});
}

ArmFrame ArmDynamics::jacobian(std::span<const double> angle_rad,
                               std::span<double> jacobian) const noexcept {
  Turned at;
  place(angle_rad, at);
  std::array<ArmFrame, kMaxArmJoints> frames;
  ArmFrame frame;
  for (std::size_t i = 0; i < count_; ++i)
    frames[i] = frame = product(frame, {links_[i].origin.position_m, at.rotation[i]});
  const ArmFrame tip = product(frame, flange_);
  for (std::size_t i = 0; i < count_; ++i) {
    const Vector3 axis = column(frames[i].rotation, 2);
    const Vector3 velocity = cross(axis, tip.position_m - frames[i].position_m);
    for (std::size_t row = 0; row < 3; ++row) {
      jacobian[row * count_ + i] = velocity[row];
      jacobian[(3 + row) * count_ + i] = axis[row];
    }
  }
  return tip;
}

double ArmDynamics::kinetic_energy(std::span<const double> angle_rad,
                                   std::span<const double> speed_rad_s) const noexcept {
  JointMatrix mass_kg_m2;
  mass_matrix(angle_rad, mass_kg_m2);
  double twice_J = 0.0;
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t j = 0; j < count_; ++j)
      twice_J += speed_rad_s[i] * mass_kg_m2[i * count_ + j] * speed_rad_s[j];
  return 0.5 * twice_J;
}

double ArmDynamics::potential_energy(std::span<const double> angle_rad) const noexcept {
  double energy_J = 0.0;
  ArmFrame frame;
  Turned at;
  place(angle_rad, at);
  for (std::size_t i = 0; i < count_; ++i) {
    frame = product(frame, {links_[i].origin.position_m, at.rotation[i]});
    const Vector3 moment =
        links_[i].body.mass_kg * frame.position_m + rotated(frame.rotation, links_[i].moment_kg_m);
    energy_J -= dot(gravity_m_s2_, moment);
  }
  return energy_J;
}

// Without square roots, whose latency would be a third of the time.
bool factor_positive(std::span<double> matrix, std::size_t n) noexcept {
  double* const a = matrix.data();
  for (std::size_t i = 0; i < n; ++i) {
    double pivot = a[i * n + i];
    for (std::size_t j = 0; j < i; ++j)  // first L D
      for (std::size_t k = 0; k < j; ++k) a[i * n + j] -= a[i * n + k] * a[j * n + k];
    for (std::size_t j = 0; j < i; ++j) {
      const double l = a[i * n + j] * a[j * n + j];
      pivot -= l * a[i * n + j];
      a[i * n + j] = l;
    }
    if (!(pivot > 0.0)) {
      std::ranges::fill(matrix, std::numeric_limits<double>::quiet_NaN());
      return false;
    }
    a[i * n + i] = 1.0 / pivot;
  }
  return true;
}

void solve_factored(std::span<const double> factor, std::span<double> x) noexcept {
  const std::size_t n = x.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < i; ++k) x[i] -= factor[i * n + k] * x[k];
  for (std::size_t i = n; i-- > 0;) {
    x[i] *= factor[i * n + i];
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= factor[k * n + i] * x[k];
  }
}

bool solve_positive(std::span<double> matrix, std::span<double> x) noexcept {
  const bool is_positive = factor_positive(matrix, x.size());
  solve_factored(matrix, x);
  return is_positive;
}

}  // namespace torsio
