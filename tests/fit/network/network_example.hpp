#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

#include "fit/network/network_initialisation.hpp"
#include "fit/network/network_trainer.hpp"
#include "fit/network/training_network.hpp"
#include "torsio/core/random.hpp"

namespace torsio::test {

/// Windows of noise with random gaps in the target.
inline WindowSet random_windows(std::size_t steps, std::size_t burn_in, std::size_t inputs,
                                std::size_t count, std::uint64_t seed) {
  Random random(seed);
  WindowSet set{.steps = steps, .burn_in = burn_in, .inputs = inputs};
  for (std::size_t n = 0; n < steps * count; ++n) {
    for (std::size_t j = 0; j < inputs; ++j)
      set.features.push_back(static_cast<float>(random.normal()));
    const bool is_used = random.uniform() < 0.8;
    set.use.push_back(is_used ? 1 : 0);
    set.targets.push_back(is_used ? static_cast<float>(random.normal()) : 0.0F);
  }
  for (std::size_t k = 0; k < count; ++k) set.starts.push_back(k * steps);
  return set;
}

inline std::vector<std::size_t> every_window(const WindowSet& set) {
  std::vector<std::size_t> windows(set.starts.size());
  std::iota(windows.begin(), windows.end(), std::size_t{0});
  return windows;
}

inline std::vector<float> initial_weights(const TrainingNetwork& network, std::uint64_t seed) {
  Random random(seed);
  std::vector<float> weights(network.parameter_count(), 0.0F);
  for (std::size_t l = 0; l < network.layers().size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    switch (layer.kind) {
      case TrainingLayer::Kind::dense:
        put_layer(initial_dense(layer.inputs, layer.units, layer.activation, random), network, l,
                  weights.data());
        break;
      case TrainingLayer::Kind::lstm:
        put_layer(initial_lstm(layer.inputs, layer.units, random), network, l, weights.data());
        break;
      case TrainingLayer::Kind::gru:
        put_layer(initial_gru(layer.inputs, layer.units, random), network, l, weights.data());
        break;
    }
  }
  return weights;
}

}  // namespace torsio::test
