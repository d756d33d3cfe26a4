#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "torsio/core/random.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio::test {

/// Fitter's data of one sequence in which every sample is used.
/// @param target of a row of features.
inline TrainingData training_data_of(std::vector<InputInfo> inputs, Matrix features,
                                     const std::function<double(std::span<const double>)>& target) {
  TrainingData data;
  data.inputs = std::move(inputs);
  data.target = "torque_Nm";
  data.sample_rate_Hz = 1000.0;
  Sequence sequence{.recording = "example", .features = std::move(features)};
  for (std::size_t n = 0; n < sequence.features.rows; ++n)
    sequence.target.push_back(target(sequence.features.row(n)));
  sequence.use.assign(sequence.target.size(), 1);
  data.sequences.push_back(std::move(sequence));
  return data;
}

inline std::vector<InputInfo> deflection_and_rate() {
  return {{.expression = "spring_deflection_rad"},
          {.expression = "rate(spring_deflection_rad)", .is_rate = true}};
}

/// Deflection and its rate over two decaying, slowly changing oscillations: 0.1 rad, about 0.6
/// rad/s.
inline Matrix oscillation(std::size_t samples) {
  Matrix features(samples, 2);
  const auto deflection = [](double t) {
    return 0.1 * std::exp(-0.05 * t) * std::sin(6.0 * t + 0.1 * t * t);
  };
  for (std::size_t n = 0; n < samples; ++n) {
    const double t = 0.001 * static_cast<double>(n);
    features(n, 0) = deflection(t);
    features(n, 1) = (deflection(t) - deflection(t - 0.001)) / 0.001;
  }
  return features;
}

/// What any family can be fitted to: a spring of 600 Nm/rad with friction and a little noise.
inline TrainingData noisy_spring(std::size_t samples = 4000) {
  Random random(7);
  return training_data_of(
      deflection_and_rate(), oscillation(samples), [&](std::span<const double> x) {
        return 0.5 + 600.0 * x[0] + 3.0 * std::tanh(x[1] / 0.05) + 0.1 * random.normal();
      });
}

}  // namespace torsio::test
