// Adapts a network to a load cell while it runs in a 1 kHz loop, and saves the adapted network:
//   10_adapt_to_load_cell joint.safetensors adapted.safetensors
#include <array>
#include <cmath>
#include <cstdio>

#include "torsio/files.hpp"
#include "torsio/runtime.hpp"

namespace {

/// Simulated measurements: angles on both sides of the spring, and a load cell at 250 Hz.
struct Tick {
  std::array<double, 2> angles_rad;  ///< gear, joint
  double load_cell_Nm;
  double load_cell_age_s;
};

Tick read_tick(int tick) {
  const auto deflection_rad = [](int at) { return 0.01 * std::sin(4e-4 * at); };
  const int measured = tick - tick % 4;
  return {.angles_rad = {deflection_rad(tick), 0.0},
          .load_cell_Nm = 650.0 * deflection_rad(measured) + 1.0,
          .load_cell_age_s = 1e-3 * (tick - measured)};
}

int run(const char* model_file, const char* adapted_file) {
  torsio::ModelFile model = torsio::load_model(model_file);
  torsio::AdaptiveEstimator estimator(model.settings, model.parameters, {.sensor_std = 0.05});
  if (estimator.raw_inputs() != std::vector<std::string>{"gear_angle_rad", "joint_angle_rad"}) {
    std::fprintf(stderr, "this example reads gear_angle_rad and joint_angle_rad\n");
    return 1;
  }
  const torsio::DenormalsOff denormals_off;
  for (int tick = 0; tick < 200000; ++tick) {
    const Tick now = read_tick(tick);
    const torsio::Estimate torque = estimator.step(now.angles_rad);  // no heap, no lock
    estimator.learn({.value = now.load_cell_Nm, .age_s = now.load_cell_age_s});
    if (tick % 40000 == 4000)
      std::printf("t = %5.1f s: %6.2f Nm, load cell %6.2f Nm\n", 1e-3 * tick, torque.value,
                  now.load_cell_Nm);
  }
  const torsio::AdaptationCounts& counts = estimator.adapter().counts();
  std::printf("%zu updates, %zu within the noise, %zu roll-backs\n", counts.updates(),
              counts.of(torsio::UpdateOutcome::dead_zone), counts.roll_backs);
  model.parameters = estimator.adapted();
  torsio::save_model(adapted_file, model);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s MODEL ADAPTED\n", argv[0]);
    return 2;
  }
  try {
    return run(argv[1], argv[2]);
  } catch (const torsio::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
