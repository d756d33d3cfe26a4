// Controls the torque of a series-elastic joint at 1 kHz through a model of its spring:
//   06_control_torque MODEL.safetensors
#include <cmath>
#include <cstdio>

#include "example_joint.hpp"
#include "torsio/files.hpp"
#include "torsio/runtime.hpp"
#include "torsio/signal/excitation.hpp"

namespace {

/// A simulated joint with locked output: J N² δ'' + b δ' + K δ = N k_t i.
class LockedJoint {
 public:
  explicit LockedJoint(const torsio::SeriesElasticJoint& parts) : parts_(parts) {}
  void drive(double current_A) {
    for (int n = 0; n < 10; ++n) {
      const double torque_Nm = parts_.drive.torque_per_current() * current_A -
                               parts_.stiffness_Nm_rad * deflection_rad_ -
                               parts_.drive.viscous_Nms_rad * rate_rad_s_;
      rate_rad_s_ += 1e-4 * torque_Nm / parts_.drive.inertia();
      deflection_rad_ += 1e-4 * rate_rad_s_;
    }
  }
  [[nodiscard]] torsio::JointSample read() const {
    return {.motor_angle_rad = parts_.drive.ratio * deflection_rad_,
            .gear_angle_rad = deflection_rad_,
            .joint_angle_rad = 0.0};
  }

 private:
  torsio::SeriesElasticJoint parts_;
  double deflection_rad_ = 0.0;
  double rate_rad_s_ = 0.0;
};

int run(const char* model_file) {
  const torsio::ModelFile model = torsio::load_model(model_file);
  const torsio::SeriesElasticJoint parts = example_joint();
  torsio::TorqueController controller(
      torsio::AnyInverse::of(model.settings, model.parameters),
      torsio::TorqueLoopCore::Settings{.deflection = {.joint = parts}, .largest_torque_Nm = 40.0},
      1000.0);  // throws if gains are unstable, or the model needs inputs that the joint does not have
  const torsio::Margins margins = controller.core().margins_of(torsio::JointOutput::locked);
  const torsio::Passivity passive = torsio::passivity(parts, controller.core().feedback());
  std::printf("phase margin %.0f degrees, gain margin %.1f, passive to %.0f rad/s\n",
              torsio::deg_from_rad(margins.phase_rad), margins.gain, passive.passive_to_rad_s);
  torsio::Chirp chirp({.amplitude = 8.0, .end_Hz = 0.5, .duration_s = 10.0}, 1000.0);
  LockedJoint joint(parts);
  const torsio::DenormalsOff denormals_off;
  for (int tick = 0; tick < 10000; ++tick) {
    const torsio::JointSample sample = joint.read();
    const auto output = controller.step(chirp.step(), sample);  // noexcept, no heap, no lock
    joint.drive(output.current_A);
    if (tick % 1000 == 500)
      std::printf("t = %4.1f s: %6.2f Nm wanted, %5.2f of %5.2f mrad, %5.2f A (%.2f forward)\n",
                  1e-3 * tick, output.wanted_torque_Nm, 1e3 * sample.spring_deflection_rad(),
                  1e3 * output.wanted_deflection_rad, output.current_A, output.feed_forward_A);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s MODEL.safetensors (written by torsio fit)\n", argv[0]);
    return 2;
  }
  try {
    return run(argv[1]);
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
