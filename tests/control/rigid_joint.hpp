#pragma once

#include <cmath>

#include "torsio/control/design/drive.hpp"
#include "torsio/control/joint_cascade.hpp"

namespace torsio::test {

/// A rotor after its current loop, and its load: J N² q̈ = N k_t i − τ, i̇ = (i* − i) / T_i.
class RigidJoint {
 public:
  explicit RigidJoint(const Drive& drive) : drive_(drive) {}

  /// In ten steps; the last half step of the angle makes the motion under a constant current exact.
  void step(double current_A, double load_Nm, double period_s) noexcept {
    constexpr int kSteps = 10;
    const double dt_s = period_s / kSteps;
    const double keep = std::exp(-dt_s / drive_.current_time_constant_s);
    for (int n = 0; n < kSteps; ++n) {
      current_A_ = current_A + (current_A_ - current_A) * keep;
      const double rad_s2 = (drive_.torque_per_current() * current_A_ - load_Nm) / drive_.inertia();
      angle_rad_ += dt_s * (speed_rad_s_ + 0.5 * dt_s * rad_s2);
      speed_rad_s_ += dt_s * rad_s2;
    }
  }

  [[nodiscard]] double angle_rad() const noexcept { return angle_rad_; }
  [[nodiscard]] double speed_rad_s() const noexcept { return speed_rad_s_; }
  [[nodiscard]] double energy_J() const noexcept {
    return 0.5 * drive_.inertia() * speed_rad_s_ * speed_rad_s_;
  }
  [[nodiscard]] JointState state(double torque_Nm) const noexcept {
    return {.angle_rad = angle_rad_, .speed_rad_s = speed_rad_s_, .torque_Nm = torque_Nm};
  }

 private:
  Drive drive_;
  double current_A_ = 0.0;
  double angle_rad_ = 0.0;
  double speed_rad_s_ = 0.0;
};

}  // namespace torsio::test
