#include <cstdio>
#include <exception>

#include "torsio/core/version.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/files/model_file.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    torsio::TorqueEstimator estimator(torsio::load_estimator(argv[1]));
    const torsio::Estimate torque =
        estimator.step({.gear_angle_rad = 0.01, .joint_angle_rad = 0.0});
    std::printf("torsio %s: %.2f Nm\n", torsio::kVersion, torque.value);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
