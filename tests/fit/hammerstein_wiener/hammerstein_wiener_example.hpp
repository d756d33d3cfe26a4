#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "model/hammerstein_wiener/hammerstein_wiener.hpp"
#include "torsio/core/random.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio::test {

/// w = u + 0.3 u^2, x = 0.3 (1 - 0.9 z^-1) / ((1 - 0.95 z^-1)(1 - 0.6 z^-1)) w, y = 2 x - 0.02 x^3.
inline HammersteinWiener::Parameters known_hammerstein_wiener() {
  return {.inputs = 1,
          .sample_period_s = 0.01,
          .input = {.values = {0.0, 1.0, 0.3}},
          .sections = sections_of({{0.3, -0.27}, {1.0, -1.55, 0.57}}),
          .output = {.values = {0.0, 2.0, 0.0, -0.02}},
          .lowest = -5.0,
          .highest = 5.0};
}

/// Coloured noise through a model, in as many records as asked for, each from rest.
inline TrainingData recorded(const HammersteinWiener::Parameters& parameters, std::size_t samples,
                             double noise, std::uint64_t seed, std::size_t records = 1) {
  Random random(seed);
  TrainingData data{.inputs = {{"u_1"}},
                    .target = "y_1",
                    .sample_rate_Hz = 1.0 / parameters.sample_period_s,
                    .sequences = {}};
  for (std::size_t r = 0; r < records; ++r) {
    Sequence sequence{.recording = "record " + std::to_string(r),
                      .features = Matrix(samples, 1),
                      .target = std::vector<double>(samples),
                      .use = std::vector<std::uint8_t>(samples, 1)};
    HammersteinWiener model(parameters);
    double u = 0.0;
    for (std::size_t n = 0; n < samples; ++n) {
      u = 0.9 * u + 0.3 * random.normal();
      sequence.features(n, 0) = u;
      sequence.target[n] = model.step({&u, 1}).value + noise * random.normal();
    }
    data.sequences.push_back(std::move(sequence));
  }
  return data;
}

}  // namespace torsio::test
