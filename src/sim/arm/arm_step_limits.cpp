#include "sim/arm/arm_step_limits.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "sim/plant/steepest_slopes.hpp"
#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/core/random.hpp"

namespace torsio {
namespace {

constexpr int kPoses = 64;

using Eigen::Index;
using Eigen::MatrixXd;

/// The coordinates are all joints, then all middle bodies, then the rotors.
class ArmSystem {
 public:
  ArmSystem(std::span<const PlantParameters> drives, FirstStageForm form)
      : joints_(static_cast<Index>(drives.size())), is_rigid_(form == FirstStageForm::rigid) {
    const Index size = joints_ * (is_rigid_ ? 2 : 3);
    stiffness_ = damping_ = inertia_ = MatrixXd::Zero(size, size);
    for (Index j = 0; j < joints_; ++j) {
      const PlantParameters& drive = drives[static_cast<std::size_t>(j)];
      const ChainSlopes slopes = steepest_slopes(drive);
      ChainSlopes viscous = viscous_slopes(drive);
      viscous.on_joint += drive.joint_viscous_Nms_rad;
      add(slopes, j, stiffness_);
      add(viscous, j, damping_);
      add_inertia(drive, slopes.first_ratio, j);
    }
  }

  void set_mass(const MatrixXd& mass_kg_m2) {
    inertia_.topLeftCorner(joints_, joints_) = mass_kg_m2;
  }
  /// The largest ω² [1/s2], and the largest rate [1/s] of the viscous terms.
  [[nodiscard]] double stiffest() const { return largest(stiffness_); }
  [[nodiscard]] double fastest_decay() const { return largest(damping_); }

 private:
  void add(const ChainSlopes& slopes, Index j, MatrixXd& to) const {
    const Index middle = joints_ + j;
    const Index rotor = 2 * joints_ + j;
    const double coupled = -slopes.second / slopes.second_ratio;
    to(j, j) += slopes.joint();
    to(j, middle) = to(middle, j) = coupled;
    if (is_rigid_) {
      to(middle, middle) = slopes.rigid_middle();
      return;
    }
    to(middle, middle) = slopes.middle();
    to(rotor, rotor) = slopes.rotor();
    to(rotor, middle) = to(middle, rotor) = -slopes.first / slopes.first_ratio;
  }

  void add_inertia(const PlantParameters& drive, double ratio, Index j) {
    const Index middle = joints_ + j;
    inertia_(middle, middle) = drive.middle_inertia_kg_m2;
    if (is_rigid_) {
      inertia_(middle, middle) += drive.rotor_inertia_kg_m2 * ratio * ratio;
    } else {
      inertia_(2 * joints_ + j, 2 * joints_ + j) = drive.rotor_inertia_kg_m2;
    }
  }

  [[nodiscard]] double largest(const MatrixXd& of) const {
    return Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(of, inertia_, Eigen::EigenvaluesOnly)
        .eigenvalues()
        .maxCoeff();
  }

  Index joints_;
  bool is_rigid_;
  MatrixXd stiffness_;
  MatrixXd damping_;
  MatrixXd inertia_;
};

MatrixXd mass_at_random(const ArmModel& arm, const ArmDynamics& dynamics, Random& random) {
  ArmDynamics::PerJoint angle_rad{};
  ArmDynamics::JointMatrix mass_kg_m2{};
  for (std::size_t j = 0; j < arm.joints.size(); ++j)
    angle_rad[j] = random.uniform(arm.joints[j].lowest_rad, arm.joints[j].highest_rad);
  dynamics.mass_matrix(angle_rad, mass_kg_m2);
  const auto size = static_cast<Index>(arm.joints.size());
  return Eigen::Map<const MatrixXd>(mass_kg_m2.data(), size, size);
}

}  // namespace

ArmStepLimits arm_step_limits(const ArmModel& arm, std::span<const PlantParameters> drives,
                              FirstStageForm form) {
  const ArmDynamics dynamics(arm);
  ArmSystem system(drives, form);
  Random random(1);
  double stiffest_1_s2 = 0.0;
  double fastest_1_s = 0.0;
  Eigen::VectorXd mobility = Eigen::VectorXd::Zero(static_cast<Index>(drives.size()));
  for (int pose = 0; pose < kPoses; ++pose) {
    const MatrixXd mass_kg_m2 = mass_at_random(arm, dynamics, random);
    system.set_mass(mass_kg_m2);
    stiffest_1_s2 = std::max(stiffest_1_s2, system.stiffest());
    fastest_1_s = std::max(fastest_1_s, system.fastest_decay());
    mobility = mobility.cwiseMax(mass_kg_m2.inverse().diagonal());
  }
  ArmStepLimits limits{.stiffness_s = 0.25 / std::sqrt(stiffest_1_s2),
                       .damping_s = 0.5 / fastest_1_s};
  for (std::size_t j = 0; j < drives.size(); ++j)
    limits.joint_inertia_kg_m2[j] = 1.0 / mobility[static_cast<Index>(j)];
  return limits;
}

}  // namespace torsio
