#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/signal/normaliser.hpp"

namespace torsio {

/// The activation function after a dense layer. The numbers are stored in model files: never
/// reorder.
enum class Activation : std::uint8_t { linear = 0, relu = 1, tanh = 2, softsign = 3, elu = 4 };

[[nodiscard]] std::string_view name(Activation activation) noexcept;
/// @throws UsageError that lists the names if there is none of that name.
[[nodiscard]] Activation activation_of(std::string_view name);

/// y = f(W x + b). Plain data, like the layers below.
struct DenseLayer {
  FloatMatrix weights;      ///< outputs x inputs
  std::vector<float> bias;  ///< outputs
  std::size_t activation = 0;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("weights", self.weights);
    visit("bias", self.bias);
    visit("activation", self.activation);
  }
  bool operator==(const DenseLayer&) const = default;
};

/// A long short-term memory of H cells, gates stacked in the order i, f, g, o (PyTorch's):
///
///     a = W x + R h₋ + b
///     c = σ(a_f) c₋ + σ(a_i) tanh(a_g),   h = σ(a_o) tanh(c)
///
/// A layer may keep the biases of W x and of R h₋ apart, as PyTorch does. It is then evaluated with PyTorch's
/// rounding, a = (W x + b) + (R h₋ + b_R) in float32 and σ and tanh rounded from double, which takes longer.
///
/// Source: paper 004 Eqs. 3-8, specification 3.4.
struct LstmLayer {
  static constexpr std::string_view kFamily = "lstm";  ///< family of a network of such layers

  FloatMatrix input_weights;      ///< W: 4H x inputs
  FloatMatrix recurrent_weights;  ///< R: 4H x H
  std::vector<float> bias;        ///< b: 4H; or 8H: b, then b_R

  [[nodiscard]] std::size_t units() const noexcept { return recurrent_weights.columns; }
  [[nodiscard]] bool keeps_biases_apart() const noexcept { return bias.size() == 8 * units(); }
  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("input_weights", self.input_weights);
    visit("recurrent_weights", self.recurrent_weights);
    visit("bias", self.bias);
  }
  bool operator==(const LstmLayer&) const = default;
};

/// A gated recurrent unit of H cells, gates stacked in the order r, z, n (PyTorch's):
///
///     r = σ(W_r x + R_r h₋ + b_r),   z = σ(W_z x + R_z h₋ + b_z)
///     n = tanh(W_n x + b_n + r (R_n h₋ + b_Rn)),   h = (1 − z) n + z h₋
///
/// Source: specification 3.4.
struct GruLayer {
  static constexpr std::string_view kFamily = "gru";  ///< family of a network of such layers

  FloatMatrix input_weights;          ///< W: 3H x inputs
  FloatMatrix recurrent_weights;      ///< R: 3H x H
  std::vector<float> input_bias;      ///< b: 3H
  std::vector<float> recurrent_bias;  ///< 3H; only its last third differs from a second b

  [[nodiscard]] std::size_t units() const noexcept { return recurrent_weights.columns; }
  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("input_weights", self.input_weights);
    visit("recurrent_weights", self.recurrent_weights);
    visit("input_bias", self.input_bias);
    visit("recurrent_bias", self.recurrent_bias);
  }
  bool operator==(const GruLayer&) const = default;
};

/// Inputs and output of a network are standardised: x = (feature - centre) / scale, and the target
/// is target.centre + target.scale y.
struct NetworkScaling {
  Normaliser::Parameters inputs;
  double target_centre = 0.0;
  double target_scale = 1.0;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("inputs", self.inputs);
    visit("target_centre", self.target_centre);
    visit("target_scale", self.target_scale);
  }
  bool operator==(const NetworkScaling&) const = default;
};

/// Numbers of a layer that training may change.
[[nodiscard]] std::size_t weight_count(const DenseLayer& layer) noexcept;
[[nodiscard]] std::size_t weight_count(const LstmLayer& layer) noexcept;
[[nodiscard]] std::size_t weight_count(const GruLayer& layer) noexcept;
template <class Layer>
[[nodiscard]] std::size_t weight_count(const std::vector<Layer>& layers) noexcept {
  std::size_t count = 0;
  for (const Layer& layer : layers) count += weight_count(layer);
  return count;
}

/// Limits of width and depth: a file that exceeds them is rejected before memory is allocated.
inline constexpr std::size_t kMaxUnits = 65536;
inline constexpr std::size_t kMaxLayers = 64;

}  // namespace torsio
