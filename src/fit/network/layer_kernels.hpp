#pragma once

#include <cstddef>

#include "torsio/model/network/network_layers.hpp"

/// What a layer does to each of its units, forwards and backwards, for many rows at once. Widths are
/// whole panels (`float_gemm::kPanel`); units beyond the layer's own have zero weights, and stay at
/// zero in every pass.
namespace torsio::layer_kernels {

/// values = f(values)
void activate(Activation activation, float* values, std::size_t count) noexcept;
/// slope *= f'(a), computed from values = f(a)
void activate_backward(Activation activation, const float* values, float* slope,
                       std::size_t count) noexcept;

/// One step of an LSTM. `gates` [rows x 4 width] in the order i, f, g, o: pre-activations on input,
/// activations on output.
struct LstmStep {
  std::size_t rows;
  std::size_t width;
  float* gates;
  const float* old_cell;  ///< [rows x width]
  float* cell;            ///< [rows x width]
};
void lstm_forward(const LstmStep& step, float* output, std::size_t output_stride) noexcept;
/// `gates` become the slopes of the loss before the activations. `output_slope` and `cell_slope`
/// [rows x width] are those of this step's h and c; `cell_slope` becomes that of the old c.
void lstm_backward(const LstmStep& step, const float* output_slope, float* cell_slope) noexcept;

/// One step of a GRU. `gates` [rows x 4 width] in the order n, r, z, m, where n = tanh(a_n + r m)
/// and m = R_n h + b_Rn: pre-activations on input, activations on output (m unchanged).
struct GruStep {
  std::size_t rows;
  std::size_t width;
  float* gates;
  const float* old_output;
  std::size_t stride;  ///< stride of the old and the new output
};
void gru_forward(const GruStep& step, float* output) noexcept;
/// `gates` become the slopes before the activations; `output_slope` [rows x width], of this step's
/// h, becomes the share of the old h's that goes straight past the gates.
void gru_backward(const GruStep& step, float* output_slope) noexcept;

/// One update of Adam over a run of numbers: what is the same for all of them.
struct AdamStep {
  float rate;        ///< learning rate / (1 - beta1^t)
  float root_scale;  ///< 1 / sqrt(1 - beta2^t)
  float decay;       ///< weights *= 1 - decay before the update (AdamW); 0: none
  float penalty;     ///< gradient += penalty * weights (L2 in Adam); 0: none
  float gradient_scale;
};
void adam(const AdamStep& step, const float* gradient, float* weights, float* mean, float* square,
          std::size_t count) noexcept;

}  // namespace torsio::layer_kernels
