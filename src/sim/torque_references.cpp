#include "torque_references.hpp"

#include <cmath>

#include "experiment_table.hpp"

namespace torsio {
namespace {

/// Over the length of the test, without the mean taken off.
double rms(auto reference) {
  const auto samples = static_cast<int>(kTorqueTest_s * kBenchRate_Hz);
  double squares = 0.0;
  for (int i = 0; i < samples; ++i) {
    const double value = reference.step();
    squares += value * value;
  }
  return std::sqrt(squares / samples);
}

}  // namespace

Chirp torque_chirp(double amplitude_Nm) {
  return {{.amplitude = amplitude_Nm, .start_Hz = 0.01, .end_Hz = 0.3, .duration_s = kTorqueTest_s},
          kBenchRate_Hz};
}

RandomWalk torque_walk(double amplitude_Nm, std::uint64_t seed) {
  // The sensors draw from `seed` itself.
  const RandomWalk of_one({.rms = 1.0, .cutoff_Hz = 1.0, .seed = ~seed}, kBenchRate_Hz);
  const double scale = rms(torque_chirp(amplitude_Nm)) / rms(of_one);
  return {{.rms = scale, .cutoff_Hz = 1.0, .seed = ~seed}, kBenchRate_Hz};
}

}  // namespace torsio
