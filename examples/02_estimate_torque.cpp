// A joint's torque in a 1 kHz loop, from a model file: links torsio::runtime and torsio::files
// only.
#include <cmath>
#include <cstdio>
#include <exception>

#include "torsio/files.hpp"
#include "torsio/runtime.hpp"

namespace {

/// A simulated joint in place of yours: its spring is wound by up to 2 degrees.
torsio::JointSample read_joint(int tick) {
  const double t_s = 1e-3 * tick;
  torsio::JointSample joint;
  joint.t_s = t_s;
  joint.joint_angle_rad = 0.5 * std::sin(0.6 * t_s);
  joint.gear_angle_rad = joint.joint_angle_rad + 0.03 * std::sin(1.2 * t_s);
  return joint;
}

int run(const char* model_file) {
  // readme-begin
  // Filters for the rate of this loop. May throw: call it before the loop.
  torsio::TorqueEstimator estimator(torsio::load_estimator(model_file, {.rate_Hz = 1000}));
  // If the mapping of the training data subtracts a zero: estimator.set_zero("gear_angle_rad", rest_rad);
  const torsio::DenormalsOff denormals_off;  // once per real-time thread
  estimator.reset();
  torsio::Fault last = torsio::Fault::none;
  for (int tick = 0; tick < 2000; ++tick) {
    const torsio::JointSample joint = read_joint(tick);     // all that the model's inputs need
    const torsio::Estimate torque = estimator.step(joint);  // noexcept, no heap, no lock
    if (torque.fault != last)  // input_not_finite, zero_not_set, outside_training_range, ...
      std::printf("t = %.3f s: fault %s\n", joint.t_s, torsio::name(torque.fault).data());
    last = torque.fault;
    if (torque.fault != torsio::Fault::none) continue;  // the value is finite, but not to be used
    if (tick % 500 == 0)
      std::printf("t = %.1f s: %6.2f Nm +- %.2f\n", joint.t_s, torque.value, torque.std_dev);
  }
  // readme-end
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s MODEL.safetensors (torsio demo writes one)\n", argv[0]);
    return 2;
  }
  try {
    return run(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
