#pragma once

#include "torsio/actuator/gear.hpp"
#include "torsio/actuator/spring.hpp"
#include "torsio/sim/plant.hpp"

// What a plant asks of a stage, whatever it is: overloads for those that transmit an angle by a
// ratio, templates for those that just twist.

namespace torsio {

struct StageMotion {
  double input_angle_rad = 0.0;
  double input_speed_rad_s = 0.0;
  double output_angle_rad = 0.0;
  double output_speed_rad_s = 0.0;
};

inline Gear make_stage(const Gear::Parameters& parameters) { return Gear(parameters); }
inline Spring make_stage(const Spring::Parameters& parameters) { return Spring(parameters); }

inline StageTorques step_stage(Gear& gear, const StageMotion& motion) noexcept {
  const Gear::Output output = gear.step(motion.input_angle_rad, motion.input_speed_rad_s,
                                        motion.output_angle_rad, motion.output_speed_rad_s);
  return {output.torque_Nm, output.rotor_torque_Nm};
}
template <class Twisting>
StageTorques step_stage(Twisting& spring, const StageMotion& motion) noexcept {
  const double torque_Nm = spring.step(motion.input_angle_rad - motion.output_angle_rad,
                                       motion.input_speed_rad_s - motion.output_speed_rad_s);
  return {torque_Nm, torque_Nm};
}

inline void reset_stage(Gear& gear, double input_rad, double output_rad) noexcept {
  gear.reset(input_rad, output_rad);
}
template <class Twisting>
void reset_stage(Twisting& spring, double input_rad, double output_rad) noexcept {
  spring.reset(input_rad - output_rad);
}

inline void set_stage_period(Gear& /*gear*/, double /*dt_s*/) noexcept {}
inline void set_stage_period(Spring& /*spring*/, double /*dt_s*/) noexcept {}
template <class Twisting>
void set_stage_period(Twisting& spring, double dt_s) noexcept {
  spring.set_period(dt_s);
}

/// The transmitted angle and its slope over the input angle.
inline Gear::Kinematics kinematics(const Gear& gear, double input_rad) noexcept {
  return gear.kinematics(input_rad);
}
template <class Twisting>
Gear::Kinematics kinematics(const Twisting& /*spring*/, double input_rad) noexcept {
  return {input_rad, 1.0};
}

/// The input angle at which the stage, friction relaxed, gives this torque.
inline double input_angle(const Gear& gear, double output_rad, double torque_Nm) noexcept {
  const Gear::Parameters& parts = gear.parameters();
  const double transmitted_rad = output_rad + torque_Nm / parts.stiffness_Nm_rad;
  double input_rad = parts.ratio * transmitted_rad;
  // The kinematic error is far flatter than the gear's own slope: this contracts.
  for (int i = 0; i < 20; ++i)
    input_rad -= parts.ratio * (gear.kinematics(input_rad).angle_rad - transmitted_rad);
  return input_rad;
}
template <class Twisting>
double input_angle(const Twisting& spring, double output_rad, double torque_Nm) noexcept {
  return output_rad + spring.deflection(torque_Nm);
}

inline double friction_torque(const Gear& gear) noexcept { return gear.hysteresis_torque(); }
template <class Twisting>
double friction_torque(const Twisting& spring) noexcept {
  return spring.friction_torque();
}

/// What damps the stage, over the rate of its twist [Nms/rad].
inline double viscosity(const Gear& gear) noexcept { return gear.parameters().damping_Nms_rad; }
template <class Twisting>
double viscosity(const Twisting& spring) noexcept {
  return spring.viscosity();
}

/// The energy [J] of the elastic part at this twist, and that of the hysteretic one.
inline double elastic_energy(const Gear& gear, double twist_rad) noexcept {
  return 0.5 * gear.parameters().stiffness_Nm_rad * twist_rad * twist_rad;
}
template <class Twisting>
double elastic_energy(const Twisting& spring, double twist_rad) noexcept {
  return spring.elastic_energy(twist_rad);
}
inline double friction_energy(const Gear& gear) noexcept { return gear.hysteresis_energy(); }
template <class Twisting>
double friction_energy(const Twisting& spring) noexcept {
  return spring.friction_energy();
}

/// The ratio of input to output angle, and the largest stiffness [Nm/rad] at the output.
inline double ratio(const Gear& gear) noexcept { return gear.parameters().ratio; }
template <class Twisting>
double ratio(const Twisting& /*spring*/) noexcept {
  return 1.0;
}
inline double steepest(const Gear& gear, double /*load_Nm*/) noexcept { return gear.steepest(); }
template <class Twisting>
double steepest(const Twisting& spring, double load_Nm) noexcept {
  return spring.steepest(load_Nm);
}

}  // namespace torsio
