#include "fit/network/network_pass.hpp"

#include <algorithm>

#include "fit/network/layer_kernels.hpp"

namespace torsio {
namespace {

using Kind = TrainingLayer::Kind;
using float_gemm::multiply;

}  // namespace

void PackedNetwork::pack(const TrainingNetwork& network, const float* parameters) {
  layers_.resize(network.layers().size());
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    const ParameterBlock& block = network.block(l);
    const float* values = parameters + block.offset;
    const float* behind_bias = values + block.columns;
    Layer& packed = layers_[l];
    packed.forward.pack(values, block.columns, block.rows, block.columns);
    if (l > 0)
      packed.to_inputs.pack_transposed(behind_bias, block.columns, block.columns, layer.inputs);
    if (layer.kind == Kind::lstm) {
      packed.to_state.pack_transposed(behind_bias + layer.inputs * block.columns, block.columns,
                                      block.columns, layer.units);
    } else if (layer.kind == Kind::gru) {
      const ParameterBlock& state = network.block(l, 1);
      const float* recurrent = parameters + state.offset;
      packed.forward_state.pack(recurrent, state.columns, state.rows, state.columns);
      packed.to_state.pack_transposed(recurrent, state.columns, state.columns, layer.units);
      packed.state_bias = parameters + network.block(l, 2).offset;
    }
  }
}

void NetworkPass::prepare(const TrainingNetwork& network, std::size_t steps, std::size_t rows) {
  if (steps == steps_ && rows == rows_ && layers_.size() == network.layers().size()) return;
  steps_ = steps;
  rows_ = rows;
  layers_.assign(network.layers().size(), {});
  std::size_t widest = 0;
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    LayerMemory& memory = layers_[l];
    const std::size_t width = layer.width();
    memory.stride = 1 + layer.inputs + (layer.has_state() ? width : 0);
    memory.rows.assign((steps + 1) * rows * memory.stride, 0.0F);
    for (std::size_t k = 0; k < (steps + 1) * rows; ++k) memory.rows[k * memory.stride] = 1.0F;
    memory.values.assign(steps * rows * (layer.has_state() ? 4 : 1) * width, 0.0F);
    memory.slopes.assign(steps * rows * width, 0.0F);
    if (layer.kind == Kind::lstm) {
      memory.cells.assign((steps + 1) * rows * width, 0.0F);
      widest = std::max(widest, width);
    }
  }
  cell_slopes_.resize(rows * widest);
}

NetworkPass::Outputs NetworkPass::outputs(const TrainingLayer& layer,
                                          const LayerMemory& memory) const {
  if (!layer.has_state()) return {memory.values.data(), layer.width()};
  // The output of a step is the old state of the next one.
  return {memory.rows.data() + rows_ * memory.stride + 1 + layer.inputs, memory.stride};
}

void NetworkPass::forward_lstm(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                               LayerMemory& memory) const {
  const std::size_t width = layer.width();
  const std::size_t step_rows = rows_ * memory.stride;
  for (std::size_t t = 0; t < steps_; ++t) {
    float* gates = memory.values.data() + t * rows_ * 4 * width;
    float* rows = memory.rows.data() + t * step_rows;
    multiply(rows, memory.stride, rows_, packed.forward, gates, 4 * width, false);
    float* cells = memory.cells.data() + t * rows_ * width;
    layer_kernels::lstm_forward({rows_, width, gates, cells, cells + rows_ * width},
                                rows + step_rows + 1 + layer.inputs, memory.stride);
  }
}

void NetworkPass::forward_gru(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                              LayerMemory& memory) const {
  const std::size_t width = layer.width();
  const std::size_t step_rows = rows_ * memory.stride;
  multiply(memory.rows.data(), memory.stride, steps_ * rows_, packed.forward, memory.values.data(),
           4 * width, false);
  for (std::size_t t = 0; t < steps_; ++t) {
    float* gates = memory.values.data() + t * rows_ * 4 * width;
    for (std::size_t row = 0; row < rows_; ++row)
      std::copy_n(packed.state_bias, width, gates + (row * 4 + 3) * width);
    float* state = memory.rows.data() + t * step_rows + 1 + layer.inputs;
    multiply(state, memory.stride, rows_, packed.forward_state, gates + width, 4 * width, true);
    layer_kernels::gru_forward({rows_, width, gates, state, memory.stride}, state + step_rows);
  }
}

void NetworkPass::forward(const TrainingNetwork& network, const PackedNetwork& packed,
                          const SequenceBatch& batch) {
  prepare(network, batch.steps, batch.rows);
  Outputs from{batch.inputs.data(), network.inputs()};
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const TrainingLayer& layer = network.layers()[l];
    LayerMemory& memory = layers_[l];
    for (std::size_t k = 0; k < steps_ * rows_; ++k)
      std::copy_n(from.values + k * from.stride, layer.inputs,
                  memory.rows.data() + k * memory.stride + 1);
    switch (layer.kind) {
      case Kind::dense:
        multiply(memory.rows.data(), memory.stride, steps_ * rows_, packed.layer(l).forward,
                 memory.values.data(), layer.width(), false);
        layer_kernels::activate(layer.activation, memory.values.data(), memory.values.size());
        break;
      case Kind::lstm: forward_lstm(layer, packed.layer(l), memory); break;
      case Kind::gru: forward_gru(layer, packed.layer(l), memory); break;
    }
    from = outputs(layer, memory);
  }
}

float NetworkPass::output(std::size_t step, std::size_t row) const {
  return layers_.back().values[(step * rows_ + row) * float_gemm::kPanel];
}

double NetworkPass::square_error(const SequenceBatch& batch) const {
  double sum = 0.0;
  for (std::size_t k = 0; k < steps_ * rows_; ++k) {
    if (batch.weights[k] == 0.0F) continue;
    const float error = layers_.back().values[k * float_gemm::kPanel] - batch.targets[k];
    sum += static_cast<double>(batch.weights[k]) * static_cast<double>(error) *
           static_cast<double>(error);
  }
  return sum;
}

void NetworkPass::backward_lstm(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                                LayerMemory& memory) {
  const std::size_t width = layer.width();
  std::ranges::fill(cell_slopes_, 0.0F);
  for (std::size_t t = steps_; t-- > 0;) {
    float* gates = memory.values.data() + t * rows_ * 4 * width;
    float* slopes = memory.slopes.data() + t * rows_ * width;
    if (t + 1 < steps_)
      multiply(gates + rows_ * 4 * width, 4 * width, rows_, packed.to_state, slopes, width, true);
    const float* cells = memory.cells.data() + t * rows_ * width;
    layer_kernels::lstm_backward(
        {rows_, width, gates, cells, memory.cells.data() + (t + 1) * rows_ * width}, slopes,
        cell_slopes_.data());
  }
}

void NetworkPass::backward_gru(const TrainingLayer& layer, const PackedNetwork::Layer& packed,
                               LayerMemory& memory) const {
  const std::size_t width = layer.width();
  for (std::size_t t = steps_; t-- > 0;) {
    float* gates = memory.values.data() + t * rows_ * 4 * width;
    float* slopes = memory.slopes.data() + t * rows_ * width;
    if (t + 1 < steps_) {
      const float* past_gates = slopes + rows_ * width;
      for (std::size_t k = 0; k < rows_ * width; ++k) slopes[k] += past_gates[k];
      multiply(gates + (rows_ * 4 + 1) * width, 4 * width, rows_, packed.to_state, slopes, width,
               true);
    }
    const float* old_state = memory.rows.data() + t * rows_ * memory.stride + 1 + layer.inputs;
    layer_kernels::gru_backward({rows_, width, gates, old_state, memory.stride}, slopes);
  }
}

void NetworkPass::add_gradient(const TrainingNetwork& network, std::size_t index, float* gradient) {
  const TrainingLayer& layer = network.layers()[index];
  const LayerMemory& memory = layers_[index];
  const bool is_dense = layer.kind == Kind::dense;
  const float* slopes = is_dense ? memory.slopes.data() : memory.values.data();
  const std::size_t stride = (is_dense ? 1 : 4) * layer.width();
  const auto add = [&](std::size_t which, std::size_t first_input, std::size_t first_gate) {
    const ParameterBlock& block = network.block(index, which);
    float_gemm::add_product_of_transposed(memory.rows.data() + first_input, memory.stride,
                                          block.rows, slopes + first_gate * layer.width(), stride,
                                          block.columns, steps_ * rows_, gradient + block.offset,
                                          block.columns, scratch_);
  };
  add(0, 0, 0);
  if (layer.kind != Kind::gru) return;
  add(1, 1 + layer.inputs, 1);
  add(2, 0, 3);
}

void NetworkPass::backward(const TrainingNetwork& network, const PackedNetwork& packed,
                           const SequenceBatch& batch, float scale, float* gradient) {
  LayerMemory& last = layers_.back();
  for (std::size_t k = 0; k < steps_ * rows_; ++k)
    last.slopes[k * float_gemm::kPanel] =
        batch.weights[k] == 0.0F
            ? 0.0F
            : scale * batch.weights[k] * (last.values[k * float_gemm::kPanel] - batch.targets[k]);
  for (std::size_t l = layers_.size(); l-- > 0;) {
    const TrainingLayer& layer = network.layers()[l];
    LayerMemory& memory = layers_[l];
    switch (layer.kind) {
      case Kind::dense:
        layer_kernels::activate_backward(layer.activation, memory.values.data(),
                                         memory.slopes.data(), memory.slopes.size());
        break;
      case Kind::lstm: backward_lstm(layer, packed.layer(l), memory); break;
      case Kind::gru: backward_gru(layer, packed.layer(l), memory); break;
    }
    add_gradient(network, l, gradient);
    if (l == 0) break;
    const float* slopes = layer.has_state() ? memory.values.data() : memory.slopes.data();
    multiply(slopes, (layer.has_state() ? 4 : 1) * layer.width(), steps_ * rows_,
             packed.layer(l).to_inputs, layers_[l - 1].slopes.data(),
             network.layers()[l - 1].width(), false);
  }
}

}  // namespace torsio
