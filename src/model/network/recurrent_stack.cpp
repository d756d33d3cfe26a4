#include "model/network/recurrent_stack.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <concepts>
#include <utility>

#include "model/network/dense_stack.hpp"
#include "model/network/network_checks.hpp"
#include "model/network/network_kernels.hpp"

namespace torsio {
namespace {

/// Rows of one block in the order of the kernels, filled unit by unit.
class BlockWriter {
 public:
  BlockWriter(detail::AlignedVector<float>& weights, std::size_t rows, std::size_t unit)
      : lanes_(network_kernels::lanes()),
        at_(weights.data() + unit / lanes_ * rows * lanes_ + unit % lanes_) {}

  void add(float value) {
    *at_ = value;
    at_ += lanes_;
  }
  /// Row `unit` of each gate's part of the matrix, column by column.
  void add(const FloatMatrix& matrix, std::size_t units, std::size_t unit) {
    for (std::size_t column = 0; column < matrix.columns; ++column)
      for (std::size_t row = unit; row < matrix.rows; row += units) add(matrix(row, column));
  }

 private:
  std::size_t lanes_;
  float* at_;
};

detail::AlignedVector<float> packed(const LstmLayer& layer) {
  const std::size_t units = layer.units();
  const std::size_t biases = layer.bias.size() / units;
  const std::size_t rows = biases + 4 * (layer.input_weights.columns + units);
  detail::AlignedVector<float> weights(padded_count(units) * rows, 0.0F);
  for (std::size_t unit = 0; unit < units; ++unit) {
    BlockWriter block(weights, rows, unit);
    for (std::size_t row = 0; row < biases; ++row) block.add(layer.bias[row * units + unit]);
    block.add(layer.input_weights, units, unit);
    block.add(layer.recurrent_weights, units, unit);
  }
  return weights;
}

detail::AlignedVector<float> packed(const GruLayer& layer) {
  const std::size_t units = layer.units();
  const std::size_t rows = 4 + 3 * (layer.input_weights.columns + units);
  detail::AlignedVector<float> weights(padded_count(units) * rows, 0.0F);
  for (std::size_t unit = 0; unit < units; ++unit) {
    BlockWriter block(weights, rows, unit);
    for (const std::size_t row : {unit, units + unit})
      block.add(layer.input_bias[row] + layer.recurrent_bias[row]);
    block.add(layer.input_bias[2 * units + unit]);
    block.add(layer.recurrent_bias[2 * units + unit]);
    block.add(layer.input_weights, units, unit);
    block.add(layer.recurrent_weights, units, unit);
  }
  return weights;
}

}  // namespace

template <class Layer>
RecurrentStack<Layer>::RecurrentStack(const std::vector<Layer>& layers, std::size_t inputs,
                                      std::size_t joints, const std::string& place)
    : inputs_(inputs), joints_(joints) {
  check_layer_count(layers.size(), place);
  for (std::size_t i = 0; i < layers.size(); ++i) {
    check_layer(layers[i], inputs, fmt::format("{}.{}", place, i));
    Packed layer{.inputs = inputs,
                 .units = layers[i].units(),
                 .stride = padded_count(layers[i].units()),
                 .weights = packed(layers[i])};
    layer.hidden.assign(joints * layer.stride, 0.0F);
    layer.other_hidden = layer.hidden;
    if constexpr (std::same_as<Layer, LstmLayer>) {
      layer.cell = layer.hidden;
      layer.biases_apart = layers[i].keeps_biases_apart();
    }
    inputs = layer.units;
    layers_.push_back(std::move(layer));
  }
}

template <class Layer>
void RecurrentStack<Layer>::reset() noexcept {
  for (std::size_t joint = 0; joint < joints_; ++joint) reset(joint);
}

template <class Layer>
void RecurrentStack<Layer>::reset(std::size_t joint) noexcept {
  for (Packed& layer : layers_) {
    std::fill_n(layer.hidden.data() + joint * layer.stride, layer.stride, 0.0F);
    if (!layer.cell.empty())
      std::fill_n(layer.cell.data() + joint * layer.stride, layer.stride, 0.0F);
  }
}

template <class Layer>
std::size_t RecurrentStack<Layer>::state_size() const noexcept {
  std::size_t size = 0;
  for (const Packed& layer : layers_) size += layer.units * (layer.cell.empty() ? 1 : 2);
  return size;
}

template <class Layer>
void RecurrentStack<Layer>::get_state(std::size_t joint, std::span<float> state) const noexcept {
  float* to = state.data();
  for (const Packed& layer : layers_) {
    to = std::copy_n(layer.hidden.data() + joint * layer.stride, layer.units, to);
    if (!layer.cell.empty())
      to = std::copy_n(layer.cell.data() + joint * layer.stride, layer.units, to);
  }
}

template <class Layer>
void RecurrentStack<Layer>::set_state(std::size_t joint, std::span<const float> state) noexcept {
  reset(joint);
  const float* from = state.data();
  for (Packed& layer : layers_) {
    std::copy_n(from, layer.units, layer.hidden.data() + joint * layer.stride);
    from += layer.units;
    if (layer.cell.empty()) continue;
    std::copy_n(from, layer.units, layer.cell.data() + joint * layer.stride);
    from += layer.units;
  }
}

template <class Layer>
void RecurrentStack<Layer>::step(const float* inputs) noexcept {
  std::size_t input_stride = inputs_;
  for (Packed& layer : layers_) {
    const network_kernels::PackedView view{layer.weights.data(), layer.inputs, layer.units,
                                           layer.stride / network_kernels::lanes()};
    const network_kernels::JointStates states{.count = joints_,
                                              .inputs = inputs,
                                              .input_stride = input_stride,
                                              .hidden = layer.hidden.data(),
                                              .next_hidden = layer.other_hidden.data(),
                                              .cell = layer.cell.data(),
                                              .state_stride = layer.stride};
    if constexpr (std::same_as<Layer, LstmLayer>) {
      (layer.biases_apart ? network_kernels::lstm_biases_apart : network_kernels::lstm)(view,
                                                                                        states);
    } else {
      network_kernels::gru(view, states);
    }
    std::swap(layer.hidden, layer.other_hidden);
    inputs = layer.hidden.data();
    input_stride = layer.stride;
  }
}

template class RecurrentStack<LstmLayer>;
template class RecurrentStack<GruLayer>;

}  // namespace torsio
