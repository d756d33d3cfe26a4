#pragma once

#include <concepts>
#include <variant>

#include "sim/plant/plant_parameters.hpp"

// What a plant asks of a stage, whatever it is.

namespace torsio {

/// Between rotor and middle body, and between middle body and joint.
using FirstStage = std::variant<Gear, SlipClutch>;
using SecondStage = std::variant<Spring, ElastomerCoupling, RubberSpring, Gear>;

/// What a stage does to the bodies at its two ends.
struct StageTorques {
  double output_Nm = 0.0;  ///< on the output body
  double input_Nm = 0.0;   ///< against the input body
};

struct StageMotion {
  double input_angle_rad = 0.0;
  double input_speed_rad_s = 0.0;
  double output_angle_rad = 0.0;
  double output_speed_rad_s = 0.0;
};

inline Gear make_stage(const Gear::Parameters& parameters) { return Gear(parameters); }
inline SlipClutch make_stage(const SlipClutch::Parameters& parameters) {
  return SlipClutch(parameters);
}
inline Spring make_stage(const Spring::Parameters& parameters) { return Spring(parameters); }
inline ElastomerCoupling make_stage(const ElastomerCoupling::Parameters& parameters) {
  return ElastomerCoupling(parameters);
}
inline RubberSpring make_stage(const RubberSpring::Parameters& parameters) {
  return RubberSpring(parameters);
}

/// Stages with a ratio; the others twist: their input and output angles differ by the twist alone.
template <class Stage>
concept Reducing = std::same_as<Stage, Gear> || std::same_as<Stage, SlipClutch>;

template <class Stage>
StageTorques step_stage(Stage& stage, const StageMotion& motion) noexcept {
  if constexpr (Reducing<Stage>) {
    const Gear::Output output = stage.step(motion.input_angle_rad, motion.input_speed_rad_s,
                                           motion.output_angle_rad, motion.output_speed_rad_s);
    return {output.torque_Nm, output.rotor_torque_Nm};
  } else {
    const double torque_Nm = stage.step(motion.input_angle_rad - motion.output_angle_rad,
                                        motion.input_speed_rad_s - motion.output_speed_rad_s);
    return {torque_Nm, torque_Nm};
  }
}

template <class Stage>
void reset_stage(Stage& stage, double input_rad, double output_rad) noexcept {
  if constexpr (Reducing<Stage>) {
    stage.reset(input_rad, output_rad);
  } else {
    stage.reset(input_rad - output_rad);
  }
}

template <class Stage>
void set_stage_period(Stage& stage, double dt_s) noexcept {
  if constexpr (requires { stage.set_period(dt_s); }) stage.set_period(dt_s);
}

/// The transmitted angle and its slope over the input angle.
template <class Stage>
Gear::Kinematics kinematics(const Stage& stage, double input_rad) noexcept {
  if constexpr (Reducing<Stage>) return stage.kinematics(input_rad);
  return {input_rad, 1.0};
}

/// The input angle at which the stage, friction relaxed, gives this torque.
template <class Stage>
double input_angle(const Stage& stage, double output_rad, double torque_Nm) noexcept {
  if constexpr (Reducing<Stage>) {
    const auto& parts = stage.parameters();
    const double transmitted_rad = output_rad + torque_Nm / parts.stiffness_Nm_rad;
    double input_rad = parts.ratio * transmitted_rad;
    // The kinematic error is far flatter than the gear's own slope: this contracts.
    for (int i = 0; i < 20; ++i)
      input_rad -= parts.ratio * (stage.kinematics(input_rad).angle_rad - transmitted_rad);
    return input_rad;
  } else {
    return output_rad + stage.deflection(torque_Nm);
  }
}

template <class Stage>
double friction_torque(const Stage& stage) noexcept {
  if constexpr (Reducing<Stage>) {
    return stage.hysteresis_torque();
  } else {
    return stage.friction_torque();
  }
}

/// What damps the stage over the rate of its twist [Nms/rad], apart from its friction.
template <class Stage>
double viscosity(const Stage& stage) noexcept {
  if constexpr (std::same_as<Stage, Gear>) return stage.parameters().damping_Nms_rad;
  if constexpr (!Reducing<Stage>) return stage.viscosity();
  return 0.0;  // the clutch's hysteresis torque holds its damping
}

/// All that damps it while nothing slips.
template <class Stage>
double strongest_damping(const Stage& stage) noexcept {
  if constexpr (Reducing<Stage>) return stage.parameters().damping_Nms_rad;
  return viscosity(stage);
}

/// The energy [J] of the elastic part at this twist, and that of the hysteretic one.
template <class Stage>
double elastic_energy(const Stage& stage, double twist_rad) noexcept {
  if constexpr (std::same_as<Stage, Gear>)
    return 0.5 * stage.parameters().stiffness_Nm_rad * twist_rad * twist_rad;
  if constexpr (!Reducing<Stage>) return stage.elastic_energy(twist_rad);
  return 0.0;  // the clutch's cable is a part of its hysteresis
}
template <class Stage>
double friction_energy(const Stage& stage) noexcept {
  if constexpr (Reducing<Stage>) {
    return stage.hysteresis_energy();
  } else {
    return stage.friction_energy();
  }
}

/// The ratio of input to output angle, and the largest stiffness [Nm/rad] at the output.
template <class Stage>
double ratio(const Stage& stage) noexcept {
  if constexpr (Reducing<Stage>) return stage.parameters().ratio;
  return 1.0;
}
template <class Stage>
double steepest(const Stage& stage, double load_Nm) noexcept {
  if constexpr (Reducing<Stage>) {
    return stage.steepest();
  } else {
    return stage.steepest(load_Nm);
  }
}

}  // namespace torsio
