#pragma once

#include <cstddef>

#include "torsio/model/network/network_layers.hpp"

namespace torsio::network_kernels {

/// Units are stored in blocks of as many as this machine's vectors have lanes; the last is padded
/// with units of weight 0. A block is a sequence of rows, one value per unit, in the order in which
/// a step reads them:
///
/// - dense: bias, then one row for each input;
/// - LSTM: bias of the gates i, f, g, o, then these four for each input, then for each unit;
/// - LSTM with separate biases: the same after eight biases, those of the inputs first;
/// - GRU: bias of r, z, n and of n's recurrent part, then r, z, n for each input, then for each unit.
///
/// Every sum is computed in that order, by fused multiply-adds where the machine has them, so that
/// one joint and many give the same bits. Separate biases are added to the finished sums.
[[nodiscard]] std::size_t lanes() noexcept;

/// A packed layer.
struct PackedView {
  const float* weights = nullptr;
  std::size_t inputs = 0;
  std::size_t units = 0;   ///< without padding
  std::size_t blocks = 0;  ///< `lanes()` units each
};

/// Inputs and outputs of a recurrent step, for `count` joints in sequence.
struct JointStates {
  std::size_t count = 1;
  const float* inputs = nullptr;
  std::size_t input_stride = 0;  ///< from one joint to the next
  const float* hidden = nullptr;
  float* next_hidden = nullptr;
  float* cell = nullptr;         ///< LSTM only
  std::size_t state_stride = 0;  ///< stride of the three above
};

/// Sigmoid and tanh are within 4e-7 of the exact ones, tanh also relative to itself. NaN stays NaN
/// in every activation.
void lstm(const PackedView& layer, const JointStates& joints) noexcept;
/// As PyTorch rounds (`LstmLayer`); sigmoid and tanh come from double.
void lstm_biases_apart(const PackedView& layer, const JointStates& joints) noexcept;
void gru(const PackedView& layer, const JointStates& joints) noexcept;

/// @param output one value a unit, padding included (it becomes 0).
void dense(const PackedView& layer, Activation activation, const float* input,
           float* output) noexcept;

/// weights . input; `count` is a multiple of `lanes()`, both are aligned.
[[nodiscard]] float dot(const float* weights, const float* input, std::size_t count) noexcept;

}  // namespace torsio::network_kernels
