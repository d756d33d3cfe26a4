#pragma once

#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "model/second_order/dynamic_bouc_wen.hpp"
#include "model/second_order/rigid_drive.hpp"
#include "torsio/core/matrix.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio::test {

/// A sum of sines with phases of its own.
inline std::vector<double> multisine(std::size_t samples, double rate_Hz, double lowest_Hz,
                                     double highest_Hz, double amplitude) {
  constexpr int kSines = 20;
  Random random(3);
  std::vector<double> force(samples, 0.0);
  for (int i = 0; i < kSines; ++i) {
    const double turn =
        6.283185307179586 * (lowest_Hz + (highest_Hz - lowest_Hz) * i / kSines) / rate_Hz;
    const double phase = 6.283185307179586 * random.uniform();
    for (std::size_t n = 0; n < samples; ++n)
      force[n] += amplitude / std::sqrt(kSines) * std::sin(turn * static_cast<double>(n) + phase);
  }
  return force;
}

/// What a model makes of a force, with noise.
template <class M>
TrainingData recorded(M model, const std::vector<double>& force, double noise) {
  Random random(5);
  TrainingData data;
  data.inputs = {{.expression = "force_N"}};
  data.target = "position_m";
  data.sample_rate_Hz = 1.0 / model.sample_period();
  Sequence sequence{.recording = "bench", .features = Matrix(force.size(), 1)};
  sequence.features.values = force;
  for (const double each : force)
    sequence.target.push_back(model.step({&each, 1}).value + noise * random.normal());
  sequence.use.assign(force.size(), 1);
  data.sequences.push_back(std::move(sequence));
  return data;
}

/// A mass on a spring beside a Bouc-Wen element.
inline DynamicBoucWen hysteretic(double exponent = 1.0) {
  return DynamicBoucWen({.mass = 2.0,
                         .damping = 10.0,
                         .stiffness = 5e4,
                         .hysteretic_stiffness = 5e4,
                         .loss = exponent == 1.0 ? 800.0 : 60.0,
                         .skew = exponent == 1.0 ? -1100.0 : -20.0,
                         .exponent = exponent,
                         .time = {.sample_period_s = 1.0 / 750.0, .substeps = 4},
                         .lowest = -1.0,
                         .highest = 1.0});
}

/// A heavy carriage on a screw, pushed to one side by its cables.
inline RigidDrive carriage(double quadratic = 0.0) {
  return RigidDrive({.inertia = 95.0,
                     .viscous = 200.0,
                     .coulomb = 20.0,
                     .offset = -3.0,
                     .viscous_quadratic = quadratic,
                     .time = {.sample_period_s = 1e-3},
                     .lowest = -10.0,
                     .highest = 10.0});
}

}  // namespace torsio::test
