#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "torsio/arm/arm_dynamics.hpp"
#include "torsio/arm/arm_model.hpp"
#include "torsio/identify/identification.hpp"

namespace torsio {

/// Mass, moment (3) and inertia about the origin (6) of a body in its frame.
inline constexpr Eigen::Index kBodyParameters = 10;
using BodyParameters = Eigen::Matrix<double, kBodyParameters, 1>;
using BodyJacobian = Eigen::Matrix<double, kBodyParameters, kBodyParameters>;

[[nodiscard]] BodyParameters body_parameters(const BodyInertia& body);
/// @returns the body with these parameters; one without mass has its centre at the origin
[[nodiscard]] BodyInertia body_of(const BodyParameters& parameters);
/// @returns the derivative of `body_parameters` by mass, centre of mass and inertia about it
[[nodiscard]] BodyJacobian parameters_by_body(const BodyInertia& body);

struct WindowSettings {
  double window_s = 0.25;
  double speed_window_s = 0.03;
  double friction_speed_rad_s = 0.02;
  std::size_t least_windows = 24;
};

/// The equations of all windows, one row per window and joint, divided by the length of a window:
///
///     columns · [links, payload; dry and viscous friction] = torque
///
/// 10 columns for each link and the payload, then one of dry and one of viscous friction per joint.
struct MomentumWindows {
  Eigen::MatrixXd columns;
  Eigen::VectorXd torque_Nm;  ///< mean of the estimated torque
  std::size_t joints = 0;
  std::vector<std::size_t> motion;  ///< the motion that each window is from
  double window_s = 0.0;
  /// The mean direction of gravity in the frame of the flange; short if it varies.
  Vector3 mean_gravity_direction = {};
  double fastest_rad_s = 0.0;
  double heaviest_Nm = 0.0;  ///< the largest torque of 1 kg at the flange on any joint, at rest

  [[nodiscard]] std::size_t windows() const { return motion.size(); }
  [[nodiscard]] Eigen::Index body_column(std::size_t body) const {
    return kBodyParameters * static_cast<Eigen::Index>(body);
  }
  [[nodiscard]] Eigen::Index friction_column() const { return body_column(joints + 1); }
};

/// @throws Error if the motions are shorter than `least_windows` together.
[[nodiscard]] MomentumWindows momentum_windows(const ArmModel& arm,
                                               std::span<const ArmMotion> motions,
                                               const WindowSettings& settings);

/// The columns of one state: how momentum, energy gradient less gravity follow from the parameters.
struct MomentumColumns {
  Eigen::MatrixXd momentum;  ///< joints x 10 (joints + 1)
  Eigen::MatrixXd force;     ///< ∂T/∂q − g, likewise

  explicit MomentumColumns(std::size_t joints);
  void set(const ArmModel& arm, const ArmDynamics& dynamics, std::span<const double> angle_rad,
           std::span<const double> speed_rad_s);
};

/// @returns the derivative at each sample, the slope of the least-squares line through 2 `half` + 1 of them; the
/// first and last `half` values are NaN
[[nodiscard]] std::vector<double> centred_slope(std::span<const double> values, std::size_t half,
                                                double sample_rate_Hz);

}  // namespace torsio
