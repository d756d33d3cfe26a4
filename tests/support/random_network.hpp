#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/core/random.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio::test {

struct NetworkShape {
  std::size_t inputs = 2;
  std::vector<std::size_t> units = {8};  ///< units of the recurrent layers
  std::vector<std::size_t> hidden = {};  ///< units of the dense layers before the last
  Activation activation = Activation::tanh;
  std::size_t warm_up_samples = 0;
  bool biases_apart = false;  ///< separate biases of an LSTM
};

/// Weights that keep signals of the order of one; 1 kHz.
class NetworkMaker {
 public:
  NetworkMaker(NetworkShape shape, std::uint64_t seed) : shape_(std::move(shape)), random_(seed) {}

  template <class Network>
  typename Network::Parameters network() {
    typename Network::Parameters parameters;
    parameters.scaling = scaling();
    if constexpr (!requires { typename Network::Layer; }) {
      parameters.layers = dense_layers(shape_.inputs);
    } else {
      std::size_t inputs = shape_.inputs;
      for (const std::size_t units : shape_.units) {
        parameters.layers.push_back(layer<typename Network::Layer>(inputs, units));
        inputs = units;
      }
      parameters.head = dense_layers(inputs);
      parameters.sample_period_s = 1e-3;
      parameters.warm_up_samples = shape_.warm_up_samples;
    }
    return parameters;
  }

 private:
  NetworkScaling scaling() const {
    NetworkScaling scaling{.inputs = {}, .target_centre = 0.5, .target_scale = 40.0};
    for (std::size_t j = 0; j < shape_.inputs; ++j) {
      scaling.inputs.centre.push_back(0.01 * static_cast<double>(j));
      scaling.inputs.scale.push_back(0.07 + 0.2 * static_cast<double>(j));
    }
    return scaling;
  }

  std::vector<float> vector(std::size_t count, double size) {
    std::vector<float> values(count);
    for (float& value : values) value = static_cast<float>(size * random_.normal());
    return values;
  }

  FloatMatrix matrix(std::size_t rows, std::size_t columns) {
    FloatMatrix result(rows, columns);
    result.values = vector(rows * columns, 1.0 / std::sqrt(static_cast<double>(columns)));
    return result;
  }

  std::vector<DenseLayer> dense_layers(std::size_t inputs) {
    std::vector<DenseLayer> layers;
    for (const std::size_t units : shape_.hidden) {
      layers.push_back({.weights = matrix(units, inputs),
                        .bias = vector(units, 0.3),
                        .activation = static_cast<std::size_t>(shape_.activation)});
      inputs = units;
    }
    layers.push_back({.weights = matrix(1, inputs), .bias = vector(1, 0.3)});
    return layers;
  }

  template <class Layer>
  Layer layer(std::size_t inputs, std::size_t units) {
    if constexpr (std::same_as<Layer, LstmLayer>) {
      return {.input_weights = matrix(4 * units, inputs),
              .recurrent_weights = matrix(4 * units, units),
              .bias = vector((shape_.biases_apart ? 8 : 4) * units, 0.3)};
    } else {
      return {.input_weights = matrix(3 * units, inputs),
              .recurrent_weights = matrix(3 * units, units),
              .input_bias = vector(3 * units, 0.3),
              .recurrent_bias = vector(3 * units, 0.3)};
    }
  }

  NetworkShape shape_;
  Random random_;
};

template <class Network>
typename Network::Parameters random_network(const NetworkShape& shape, std::uint64_t seed) {
  return NetworkMaker(shape, seed).network<Network>();
}

}  // namespace torsio::test
