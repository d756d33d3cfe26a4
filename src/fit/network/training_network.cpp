#include "fit/network/training_network.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace torsio {
namespace {

using Kind = TrainingLayer::Kind;

/// One gate of a layer: rows of the layer's own matrix <-> columns of a block.
struct Gate {
  std::size_t in_layer;
  std::size_t in_block;
};

constexpr std::array<Gate, 4> kLstmGates{{{0, 0}, {1, 1}, {2, 2}, {3, 3}}};
// Model files have r, z, n. The block of the inputs has n, r, z, the recurrent one r, z, m.
constexpr std::array<Gate, 3> kGruInputGates{{{0, 1}, {1, 2}, {2, 0}}};
constexpr std::array<Gate, 3> kGruStateGates{{{0, 0}, {1, 1}, {2, 2}}};

/// Calls `visit(weight, parameter)` for the weights of one gate in the block that starts at that
/// row.
template <class Weights, class Parameter, class Visit>
void for_each_weight(Weights& weights, const TrainingLayer& layer, const ParameterBlock& block,
                     std::size_t first_row, Gate gate, Parameter* parameters, const Visit& visit) {
  for (std::size_t u = 0; u < layer.units; ++u)
    for (std::size_t j = 0; j < weights.columns; ++j)
      visit(weights.values[(gate.in_layer * layer.units + u) * weights.columns + j],
            parameters[block.offset + (first_row + j) * block.columns +
                       gate.in_block * layer.width() + u]);
}

template <class Bias, class Parameter, class Visit>
void for_each_bias(Bias& bias, const TrainingLayer& layer, const ParameterBlock& block, Gate gate,
                   Parameter* parameters, const Visit& visit) {
  for (std::size_t u = 0; u < layer.units; ++u)
    visit(bias[gate.in_layer * layer.units + u],
          parameters[block.offset + gate.in_block * layer.width() + u]);
}

template <class Layer, class Parameter, class Visit>
void walk_dense(Layer& dense, const TrainingLayer& layer, const ParameterBlock& block,
                Parameter* parameters, const Visit& visit) {
  for_each_weight(dense.weights, layer, block, 1, {0, 0}, parameters, visit);
  for_each_bias(dense.bias, layer, block, {0, 0}, parameters, visit);
}

template <class Layer, class Parameter, class Visit>
void walk_lstm(Layer& lstm, const TrainingLayer& layer, const ParameterBlock& block,
               Parameter* parameters, const Visit& visit) {
  for (const Gate gate : kLstmGates) {
    for_each_bias(lstm.bias, layer, block, gate, parameters, visit);
    for_each_weight(lstm.input_weights, layer, block, 1, gate, parameters, visit);
    for_each_weight(lstm.recurrent_weights, layer, block, 1 + layer.inputs, gate, parameters,
                    visit);
  }
}

template <class Layer, class Parameter, class Visit>
void walk_gru(Layer& gru, const TrainingNetwork& network, std::size_t index, Parameter* parameters,
              const Visit& visit) {
  const TrainingLayer& layer = network.layers()[index];
  for (const Gate gate : kGruInputGates) {
    for_each_bias(gru.input_bias, layer, network.block(index), gate, parameters, visit);
    for_each_weight(gru.input_weights, layer, network.block(index), 1, gate, parameters, visit);
  }
  for (const Gate gate : kGruStateGates)
    for_each_weight(gru.recurrent_weights, layer, network.block(index, 1), 0, gate, parameters,
                    visit);
  for_each_bias(gru.recurrent_bias, layer, network.block(index, 2), {2, 0}, parameters, visit);
}

constexpr auto kPut = [](float weight, float& parameter) { parameter = weight; };
constexpr auto kTake = [](float& weight, float parameter) { weight = parameter; };

}  // namespace

TrainingNetwork::TrainingNetwork(std::vector<TrainingLayer> layers) : layers_(std::move(layers)) {
  const auto add = [this](std::size_t rows, std::size_t columns, bool begins_with_bias = true) {
    blocks_.push_back({parameter_count_, rows, columns, begins_with_bias});
    parameter_count_ += rows * columns;
  };
  for (const TrainingLayer& layer : layers_) {
    first_blocks_.push_back(blocks_.size());
    switch (layer.kind) {
      case Kind::dense: add(1 + layer.inputs, layer.width()); break;
      case Kind::lstm: add(1 + layer.inputs + layer.units, 4 * layer.width()); break;
      case Kind::gru:
        add(1 + layer.inputs, 3 * layer.width());
        add(layer.units, 3 * layer.width(), false);
        add(1, layer.width());
        break;
    }
  }
}

std::size_t TrainingNetwork::pass_bytes(std::size_t steps, std::size_t rows) const noexcept {
  std::size_t floats_a_row = 0;
  for (const TrainingLayer& layer : layers_) {
    const std::size_t own = layer.has_state() ? 7 : 2;  // gates, cells, outputs and slopes
    floats_a_row += 1 + layer.inputs + own * layer.width();
  }
  return (steps + 1) * rows * floats_a_row * sizeof(float);
}

void put_layer(const DenseLayer& layer, const TrainingNetwork& network, std::size_t index,
               float* parameters) {
  walk_dense(layer, network.layers()[index], network.block(index), parameters, kPut);
}

void put_layer(const LstmLayer& layer, const TrainingNetwork& network, std::size_t index,
               float* parameters) {
  walk_lstm(layer, network.layers()[index], network.block(index), parameters, kPut);
}

void put_layer(const GruLayer& layer, const TrainingNetwork& network, std::size_t index,
               float* parameters) {
  GruLayer one_bias = layer;
  for (std::size_t u = 0; u < 2 * layer.units(); ++u)
    one_bias.input_bias[u] += one_bias.recurrent_bias[u];
  walk_gru(one_bias, network, index, parameters, kPut);
}

DenseLayer dense_layer(const TrainingNetwork& network, std::size_t index, const float* parameters) {
  const TrainingLayer& layer = network.layers()[index];
  DenseLayer dense{.weights = FloatMatrix(layer.units, layer.inputs),
                   .bias = std::vector<float>(layer.units),
                   .activation = static_cast<std::size_t>(layer.activation)};
  walk_dense(dense, layer, network.block(index), parameters, kTake);
  return dense;
}

LstmLayer lstm_layer(const TrainingNetwork& network, std::size_t index, const float* parameters) {
  const TrainingLayer& layer = network.layers()[index];
  LstmLayer lstm{.input_weights = FloatMatrix(4 * layer.units, layer.inputs),
                 .recurrent_weights = FloatMatrix(4 * layer.units, layer.units),
                 .bias = std::vector<float>(4 * layer.units)};
  walk_lstm(lstm, layer, network.block(index), parameters, kTake);
  return lstm;
}

GruLayer gru_layer(const TrainingNetwork& network, std::size_t index, const float* parameters) {
  const TrainingLayer& layer = network.layers()[index];
  GruLayer gru{.input_weights = FloatMatrix(3 * layer.units, layer.inputs),
               .recurrent_weights = FloatMatrix(3 * layer.units, layer.units),
               .input_bias = std::vector<float>(3 * layer.units),
               .recurrent_bias = std::vector<float>(3 * layer.units)};
  walk_gru(gru, network, index, parameters, kTake);
  return gru;
}

}  // namespace torsio
