// Torque control within limits of position and speed, and a stop of category 1 (ramp, then brake):
//   07_limit_and_stop_joint
#include <cstdio>

#include "example_joint.hpp"
#include "torsio/runtime.hpp"

namespace {

/// A simulated motor that turns freely: J N² θ'' + b θ' = N k_t i.
struct Motor {
  torsio::Drive drive;
  double angle_rad = 0.0;
  double speed_rad_s = 0.0;
  void step(double current_A) {
    for (int n = 0; n < 10; ++n) {
      const double torque_Nm =
          drive.torque_per_current() * current_A - drive.viscous_Nms_rad * speed_rad_s;
      speed_rad_s += 1e-4 * torque_Nm / drive.inertia();
      angle_rad += 1e-4 * speed_rad_s;
    }
  }
};

int run() {
  const torsio::SeriesElasticJoint joint = example_joint();
  torsio::JointController controller(
      torsio::LinearInverse(joint.stiffness_Nm_rad),
      torsio::JointControllerCore::Settings{.torque = {.deflection = {.joint = joint}},
                                            .limits = {.lowest_rad = -0.5,
                                                       .highest_rad = 0.5,
                                                       .speed_rad_s = 1.0,
                                                       .max_unmeasured_load_Nm = 2.0,
                                                       .max_measured_load_Nm = 30.0}},
      1000.0);  // throws if the limits contradict each other or the drive
  torsio::JointStop stop({.drive = joint.drive,
                          .speed_rad_s = 1.0,
                          .deceleration_rad_s2 = 5.0,
                          .brake_static_Nm = 100.0,
                          .brake_sliding_Nm = 80.0,
                          .brake_engage_s = 0.02,
                          .brake_release_s = 0.04,
                          .load_Nm = 20.0},  // throws if the brake is weaker than this load
                         1000.0);
  Motor motor{joint.drive};
  for (int tick = 0; tick < 3000; ++tick) {
    const torsio::JointState state = {motor.angle_rad, motor.speed_rad_s, 0.0};
    if (tick == 2300) stop.trigger(torsio::StopCategory::ramp_and_brake);
    const double wanted_Nm = tick < 2000 ? 5.0 : -5.0;  // nothing holds the joint: it accelerates
    const auto reference =
        stop.reference({.mode = torsio::JointMode::torque, .torque_Nm = wanted_Nm}, state);
    const auto output =
        controller.step(reference, {.motor_angle_rad = motor.angle_rad * joint.drive.ratio,
                                    .gear_angle_rad = motor.angle_rad,
                                    .joint_angle_rad = motor.angle_rad});
    const auto command = stop.step(output.current_A, state, output.fault);
    if (command.is_current_cut) controller.track(command.current_A);
    motor.step(command.current_A);
    if (tick % 200 == 0)
      std::printf("t = %.1f s: %6.3f rad, %6.3f rad/s, %6.3f A, limit %s, stop %s, at rest: %s\n",
                  1e-3 * tick, motor.angle_rad, motor.speed_rad_s, command.current_A,
                  name(output.limit).data(), name(command.phase).data(),
                  command.is_drive_at_rest ? "yes" : "no");
  }
  return 0;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
