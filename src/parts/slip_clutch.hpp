#pragma once

#include <algorithm>
#include <cmath>

#include "parts/gear.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio {

/// A cable drive that ends in a friction clutch: elastic until it slips, then it holds less than it
/// took to make it slip.
///
///     x = θ_m / N − q,   F = k (x − s)             s slipped angle [rad]
///     sticks (ṡ = 0) until |F| > T_s; slips with |F| = T_k until the motion turns (F dx < 0)
///     T = F + c ẋ while it sticks, at most T_s;   T = F while it slips
///
/// A cable that is not stretched further dissipates nothing: c has no effect during slip. A clutch
/// that stopped after slipping continues to slip at T_k when it is moved further. Source:
/// specification 4.4; c is assumed.
class SlipClutch {
 public:
  using Output = Gear::Output;
  using Kinematics = Gear::Kinematics;
  struct Parameters {
    double ratio = 1.0;              ///< N
    double stiffness_Nm_rad = 0.0;   ///< k, of the cable at the clutch
    double static_torque_Nm = 0.0;   ///< T_s
    double sliding_ratio = 0.9;      ///< T_k / T_s
    double damping_Nms_rad = 0.005;  ///< c; c / k is 0.1 ms for 50 Nm/rad
  };

  /// @throws Error if ratio, stiffness or static torque is not positive, the sliding ratio not in
  /// 0..1, or the damping negative.
  explicit SlipClutch(const Parameters& parameters);
  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  /// Sticking at these angles, the cable stretched by all of the twist that the clutch can hold;
  /// what is beyond has slipped.
  void reset(double rotor_angle_rad, double middle_angle_rad) noexcept;

  Output step(double rotor_angle_rad, double rotor_speed_rad_s, double middle_angle_rad,
              double middle_speed_rad_s) noexcept TORSIO_REALTIME {
    const double twist_rad = rotor_angle_rad * inverse_ratio_ - middle_angle_rad;
    const double increment_rad = twist_rad - twist_rad_;
    twist_rad_ = twist_rad;
    twist_rate_rad_s_ = rotor_speed_rad_s * inverse_ratio_ - middle_speed_rad_s;
    if (is_slipping_ && cable_Nm_ * increment_rad < 0.0) is_slipping_ = false;
    if (!is_slipping_) {
      cable_Nm_ = parameters_.stiffness_Nm_rad * (twist_rad - slip_rad_);
      is_slipping_ = std::abs(cable_Nm_) > parameters_.static_torque_Nm;
    }
    if (is_slipping_) {
      cable_Nm_ = std::copysign(sliding_Nm_, cable_Nm_);
      slip_rad_ = twist_rad - cable_Nm_ / parameters_.stiffness_Nm_rad;
    }
    torque_Nm_ = is_slipping_ ? cable_Nm_ : damped(cable_Nm_);
    return {torque_Nm_, torque_Nm_ * inverse_ratio_};
  }

  /// The angle of the middle body without load and slip, and its slope over the rotor angle.
  [[nodiscard]] Kinematics kinematics(double rotor_angle_rad) const noexcept TORSIO_REALTIME {
    return {rotor_angle_rad * inverse_ratio_, inverse_ratio_};
  }

  [[nodiscard]] bool is_slipping() const noexcept { return is_slipping_; }
  /// @returns s [rad], forth less back
  [[nodiscard]] double slip() const noexcept { return slip_rad_; }

  /// @returns x [rad], ẋ [rad/s] of the last step
  [[nodiscard]] double twist() const noexcept { return twist_rad_; }
  [[nodiscard]] double twist_rate() const noexcept { return twist_rate_rad_s_; }
  /// @returns the last step's whole torque [Nm], damping included: none of it depends on the twist
  /// alone
  [[nodiscard]] double hysteresis_torque() const noexcept { return torque_Nm_; }
  /// @returns 0 [J]: the cable's energy is that of the hysteresis
  [[nodiscard]] static constexpr double elastic_energy() noexcept { return 0.0; }
  [[nodiscard]] double hysteresis_energy() const noexcept {
    return 0.5 * cable_Nm_ * cable_Nm_ / parameters_.stiffness_Nm_rad;
  }
  /// @returns k [Nm/rad]
  [[nodiscard]] double steepest() const noexcept { return parameters_.stiffness_Nm_rad; }

 private:
  [[nodiscard]] double damped(double cable_Nm) const noexcept {
    const double torque_Nm = cable_Nm + parameters_.damping_Nms_rad * twist_rate_rad_s_;
    const double limit_Nm = parameters_.static_torque_Nm;
    return std::min(std::max(torque_Nm, -limit_Nm), limit_Nm);
  }

  Parameters parameters_;
  double inverse_ratio_;
  double sliding_Nm_;
  double twist_rad_ = 0.0;
  double twist_rate_rad_s_ = 0.0;
  double slip_rad_ = 0.0;
  double cable_Nm_ = 0.0;   ///< F
  double torque_Nm_ = 0.0;  ///< T
  bool is_slipping_ = false;
};

}  // namespace torsio
