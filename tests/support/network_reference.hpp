#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <span>
#include <vector>

#include "model/network/gru.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"

namespace torsio::test {

using Values = std::vector<double>;

inline double activated(Activation activation, double x) {
  switch (activation) {
    case Activation::linear: return x;
    case Activation::relu: return x > 0.0 ? x : 0.0;
    case Activation::tanh: return std::tanh(x);
    case Activation::softsign: return x / (1.0 + std::abs(x));
    case Activation::elu: return x > 0.0 ? x : std::expm1(x);
  }
  return x;
}

inline double sigmoid(double x) { return 1.0 / (1.0 + std::exp(-x)); }

/// Row `row` of the matrix times x.
inline double product(const FloatMatrix& matrix, std::size_t row, const Values& x) {
  double sum = 0.0;
  for (std::size_t j = 0; j < matrix.columns; ++j)
    sum += static_cast<double>(matrix(row, j)) * x[j];
  return sum;
}

/// A network straight from its equations (model/network/network_layers.hpp), all in double.
template <class Network>
class NetworkReference {
 public:
  explicit NetworkReference(typename Network::Parameters parameters)
      : parameters_(std::move(parameters)) {
    if constexpr (!std::same_as<Network, Mlp>)
      for (const auto& layer : parameters_.layers) {
        hidden_.emplace_back(layer.units(), 0.0);
        cell_.emplace_back(layer.units(), 0.0);
      }
  }

  double step(std::span<const double> features) {
    const auto& scaling = parameters_.scaling;
    Values x;
    for (std::size_t j = 0; j < features.size(); ++j)
      x.push_back((features[j] - scaling.inputs.centre[j]) / scaling.inputs.scale[j]);
    if constexpr (std::same_as<Network, Mlp>) {
      x = dense(parameters_.layers, x);
    } else {
      for (std::size_t i = 0; i < parameters_.layers.size(); ++i) {
        advance(parameters_.layers[i], x, hidden_[i], cell_[i]);
        x = hidden_[i];
      }
      x = dense(parameters_.head, x);
    }
    return scaling.target_centre + scaling.target_scale * x[0];
  }

 private:
  static Values dense(const std::vector<DenseLayer>& layers, Values x) {
    for (const DenseLayer& layer : layers) {
      Values next;
      for (std::size_t row = 0; row < layer.weights.rows; ++row)
        next.push_back(
            activated(static_cast<Activation>(layer.activation),
                      product(layer.weights, row, x) + static_cast<double>(layer.bias[row])));
      x = next;
    }
    return x;
  }

  static void advance(const LstmLayer& layer, const Values& x, Values& h, Values& c) {
    const std::size_t units = layer.units();
    const Values before = h;
    for (std::size_t unit = 0; unit < units; ++unit) {
      const auto gate = [&](std::size_t index) {
        const std::size_t row = index * units + unit;
        return product(layer.input_weights, row, x) +
               product(layer.recurrent_weights, row, before) +
               static_cast<double>(layer.bias[row]) +
               (layer.keeps_biases_apart() ? static_cast<double>(layer.bias[4 * units + row])
                                           : 0.0);
      };
      c[unit] = sigmoid(gate(1)) * c[unit] + sigmoid(gate(0)) * std::tanh(gate(2));
      h[unit] = sigmoid(gate(3)) * std::tanh(c[unit]);
    }
  }

  static void advance(const GruLayer& layer, const Values& x, Values& h, Values& /*c*/) {
    const std::size_t units = layer.units();
    const Values before = h;
    for (std::size_t unit = 0; unit < units; ++unit) {
      const auto from_input = [&](std::size_t gate) {
        const std::size_t row = gate * units + unit;
        return product(layer.input_weights, row, x) + static_cast<double>(layer.input_bias[row]);
      };
      const auto from_before = [&](std::size_t gate) {
        const std::size_t row = gate * units + unit;
        return product(layer.recurrent_weights, row, before) +
               static_cast<double>(layer.recurrent_bias[row]);
      };
      const double r = sigmoid(from_input(0) + from_before(0));
      const double z = sigmoid(from_input(1) + from_before(1));
      const double n = std::tanh(from_input(2) + r * from_before(2));
      h[unit] = (1.0 - z) * n + z * before[unit];
    }
  }

  typename Network::Parameters parameters_;
  std::vector<Values> hidden_;
  std::vector<Values> cell_;
};

}  // namespace torsio::test
