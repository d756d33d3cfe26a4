#pragma once

#include <cmath>

#include "torsio/control/design/series_elastic_joint.hpp"
#include "torsio/estimate/joint_sample.hpp"

namespace torsio::test {

/// A `SeriesElasticJoint` in motion, in steps of a twentieth of a tick, speeds before positions.
class SpringJoint {
 public:
  SpringJoint(const SeriesElasticJoint& joint, JointOutput output)
      : parts_(joint), is_locked_(output == JointOutput::locked) {}

  void step(double wanted_A, double period_s, double external_Nm = 0.0,
            double drive_Nm = 0.0) noexcept {
    constexpr int kSteps = 20;
    const double dt_s = period_s / kSteps;
    const Drive& drive = parts_.drive;
    const double keep = std::exp(-dt_s / drive.current_time_constant_s);
    for (int n = 0; n < kSteps; ++n) {
      current_A_ = wanted_A + (current_A_ - wanted_A) * keep;
      const double spring_Nm = torque_Nm();
      speed_rad_s_ += dt_s *
                      (drive.torque_per_current() * current_A_ + drive_Nm - spring_Nm -
                       drive.viscous_Nms_rad * speed_rad_s_) /
                      drive.inertia();
      angle_rad_ += dt_s * speed_rad_s_;
      if (is_locked_) continue;
      joint_speed_rad_s_ +=
          dt_s * (spring_Nm + external_Nm - parts_.joint_viscous_Nms_rad * joint_speed_rad_s_) /
          parts_.joint_inertia_kg_m2;
      joint_rad_ += dt_s * joint_speed_rad_s_;
    }
  }

  [[nodiscard]] double deflection_rad() const noexcept { return angle_rad_ - joint_rad_; }
  [[nodiscard]] double torque_Nm() const noexcept {
    return parts_.stiffness_Nm_rad * deflection_rad();
  }
  [[nodiscard]] double angle_rad() const noexcept { return angle_rad_; }
  [[nodiscard]] double speed_rad_s() const noexcept { return speed_rad_s_; }
  [[nodiscard]] double joint_rad() const noexcept { return joint_rad_; }
  [[nodiscard]] double joint_speed_rad_s() const noexcept { return joint_speed_rad_s_; }
  [[nodiscard]] double spring_J() const noexcept { return 0.5 * torque_Nm() * deflection_rad(); }
  /// Energy of rotor, spring and joint.
  [[nodiscard]] double energy_J() const noexcept {
    return 0.5 * (parts_.drive.inertia() * speed_rad_s_ * speed_rad_s_ +
                  parts_.joint_inertia_kg_m2 * joint_speed_rad_s_ * joint_speed_rad_s_ +
                  parts_.stiffness_Nm_rad * deflection_rad() * deflection_rad());
  }

 private:
  SeriesElasticJoint parts_;
  bool is_locked_;
  double current_A_ = 0.0;
  double angle_rad_ = 0.0;
  double speed_rad_s_ = 0.0;
  double joint_rad_ = 0.0;
  double joint_speed_rad_s_ = 0.0;
};

inline JointSample sample_of(const SpringJoint& joint, const Drive& drive) {
  return {.motor_angle_rad = joint.angle_rad() * drive.ratio,
          .gear_angle_rad = joint.angle_rad(),
          .joint_angle_rad = joint.joint_rad()};
}

}  // namespace torsio::test
