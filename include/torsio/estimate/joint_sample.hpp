#pragma once

#include <span>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// The measurements of a series-elastic joint at one control tick. A field that is not set stays
/// NaN: a fault if the model needs it, never a guess.
struct JointSample {
  double t_s = kNotMeasured;
  double motor_angle_rad = kNotMeasured;  ///< rotor side, before the gear
  double gear_angle_rad = kNotMeasured;   ///< gear output: the spring's motor side
  double joint_angle_rad = kNotMeasured;  ///< link: the spring's far side
  double motor_current_A = kNotMeasured;  ///< quadrature axis; positive drives the joint forward

  /// The spring's deflection gear - joint (specification 0): torque on the link rises with it.
  [[nodiscard]] double spring_deflection_rad() const noexcept {
    return gear_angle_rad - joint_angle_rad;
  }
};

namespace detail {

/// Writes the raw channels that an estimator requires, taken by name from a `JointSample`: its
/// fields and `spring_deflection_rad`.
class JointInputs {
 public:
  /// @throws Error naming the raw input that a `JointSample` does not have, or if the target is not
  /// a torque in Nm.
  JointInputs(const std::vector<std::string>& raw_inputs, const std::string& target);

  std::span<const double> from(const JointSample& sample) noexcept TORSIO_REALTIME;

 private:
  using Getter = double (*)(const JointSample&) noexcept;
  std::vector<Getter> getters_;
  std::vector<double> raw_;
};

}  // namespace detail

}  // namespace torsio
