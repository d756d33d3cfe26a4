#pragma once

#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/estimate/joint_sample.hpp"

namespace torsio {

/// The four coefficients of (18) or (19), in SI. The paper prints p1 in Nm/deg and p2 in
/// Nm/(deg/s); files convert both when they are read.
struct DeflectionTorque {
  double offset_Nm = 0.0;         ///< p0
  double stiffness_Nm_rad = 0.0;  ///< p1, below 0 with the signs of the deflections below
  double viscous_Nms_rad = 0.0;   ///< p2
  double coulomb_Nm = 0.0;        ///< p3; the friction level of a moving joint is p3 pi/2

  bool operator==(const DeflectionTorque&) const = default;
};

/// The torque of a series-elastic joint from three sources: motor current, deflection of the gear
/// and deflection of the spring.
///
///     τ_mot    = k_t k_r i                                                  (15), (17)
///     τ_gear   = p0 + p1 Δq_gear   + p2 q̇ + p3 atan(100 q̇)                 (18)
///     τ_spring = p0 + p1 Δq_spring + p2 q̇ + p3 atan(100 q̇)                 (19)
///     Δq_gear  = q_gear − q_motor / k_r,   Δq_spring = q_joint − q_gear
///
/// atan takes q̇ in deg/s and returns radians. Both deflections have the sign of the paper's Table 3:
/// a torque on the link in +q makes them negative, hence p1 < 0 (`spring_deflection_rad` elsewhere
/// has the opposite sign).
///
/// What each measures. All three are torques on the motor side of the joint's friction, referred to
/// the joint by the gear ratio: p0 to p3 are fitted to τ_mot (16), so p2 and p3 add the friction of
/// gear and bearing to what the deflection shows. The torque on the load is p0 + p1 Δq alone,
/// `gear_load_Nm` and `spring_load_Nm`; the motor current has no such part. The three are not
/// independent: gear and spring share the gear's encoder, and q̇ is in both. Its offset and scale
/// are those of τ_mot, so an error of k_t is an error of all three.
///
/// Cost: one atan and 12 multiplications. Source: paper 000, (15) to (19); specification 3.9.
class MotorReferencedTorques {
 public:
  struct Parameters {
    double torque_constant_Nm_A = 0.0;  ///< k_t
    double gear_ratio = 1.0;            ///< k_r
    DeflectionTorque gear = {};
    DeflectionTorque spring = {};

    bool operator==(const Parameters&) const = default;
  };

  /// Each torque with the fault of the sensors that it needs. With a fault the last value is held,
  /// 0 before the first.
  struct Output {
    double motor_Nm = 0.0;        ///< motor side, friction included, as the next two
    double gear_Nm = 0.0;         ///< (18)
    double spring_Nm = 0.0;       ///< (19)
    double gear_load_Nm = 0.0;    ///< p0 + p1 Δq_gear: on the load, without friction terms
    double spring_load_Nm = 0.0;  ///< p0 + p1 Δq_spring: the same
    Fault motor_fault = Fault::none;
    Fault gear_fault = Fault::none;
    Fault spring_fault = Fault::none;
  };

  /// @throws Error if torque constant or ratio is not positive, or a coefficient not finite.
  explicit MotorReferencedTorques(const Parameters& parameters);

  void reset() noexcept { last_ = {}; }

  /// @param joint_speed_rad_s q̇, of the same filter as in the fit
  /// @returns `Fault::input_not_finite` for each torque of which a sensor or the speed is missing,
  /// `Fault::model_not_finite` if finite inputs give none
  Output step(const JointSample& sample, double joint_speed_rad_s) noexcept TORSIO_REALTIME;

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }

  /// q_joint − q_gear [rad].
  [[nodiscard]] static double spring_deflection(const JointSample& sample) noexcept {
    return sample.joint_angle_rad - sample.gear_angle_rad;
  }
  /// q_gear − q_motor / k_r [rad].
  [[nodiscard]] static double gear_deflection(const JointSample& sample,
                                              double gear_ratio) noexcept {
    return sample.gear_angle_rad - sample.motor_angle_rad / gear_ratio;
  }
  /// atan(100 q̇), q̇ in deg/s: the regressor of p3.
  [[nodiscard]] static double coulomb_regressor(double joint_speed_rad_s) noexcept;

 private:
  Parameters parameters_;
  Output last_;
};

}  // namespace torsio
