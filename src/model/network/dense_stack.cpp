#include "model/network/dense_stack.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "model/network/network_checks.hpp"
#include "model/network/network_kernels.hpp"

namespace torsio {
namespace {

detail::AlignedVector<float> packed(const DenseLayer& layer) {
  const std::size_t lanes = network_kernels::lanes();
  const auto [units, inputs, values] = layer.weights;
  detail::AlignedVector<float> weights(padded_count(units) * (1 + inputs), 0.0F);
  for (std::size_t unit = 0; unit < units; ++unit) {
    float* const block = weights.data() + unit / lanes * (1 + inputs) * lanes + unit % lanes;
    block[0] = layer.bias[unit];
    for (std::size_t column = 0; column < inputs; ++column)
      block[(1 + column) * lanes] = layer.weights(unit, column);
  }
  return weights;
}

}  // namespace

std::size_t padded_count(std::size_t count) noexcept {
  const std::size_t lanes = network_kernels::lanes();
  return (count + lanes - 1) / lanes * lanes;
}

DenseStack::DenseStack(const std::vector<DenseLayer>& layers, std::size_t inputs,
                       const std::string& place) {
  check_layer_count(layers.size(), place);
  const std::string last_place = fmt::format("{}.{}", place, layers.size() - 1);
  last_inputs_ = inputs;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    check_layer(layers[i], last_inputs_, fmt::format("{}.{}", place, i));
    if (i + 1 == layers.size()) break;
    const std::size_t units = layers[i].weights.rows;
    hidden_.push_back({.inputs = last_inputs_,
                       .units = units,
                       .blocks = padded_count(units) / network_kernels::lanes(),
                       .activation = static_cast<Activation>(layers[i].activation),
                       .weights = packed(layers[i]),
                       .output = detail::AlignedVector<float>(padded_count(units), 0.0F)});
    last_inputs_ = units;
  }
  const DenseLayer& last = layers.back();
  check_last_layer(last, last_place);
  last_weights_.assign(padded_count(last_inputs_), 0.0F);
  std::ranges::copy(last.weights.values, last_weights_.begin());
  last_bias_ = last.bias.front();
}

float DenseStack::evaluate(const float* input) noexcept {
  for (Hidden& layer : hidden_) {
    network_kernels::dense({layer.weights.data(), layer.inputs, layer.units, layer.blocks},
                           layer.activation, input, layer.output.data());
    input = layer.output.data();
  }
  return last_bias_ + network_kernels::dot(last_weights_.data(), input, last_weights_.size());
}

}  // namespace torsio
