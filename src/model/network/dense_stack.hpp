#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/aligned_vector.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// Dense layers in series, the last linear with one output, packed for the machine's vectors when
/// constructed. Evaluated in float32.
class DenseStack {
 public:
  /// @param inputs of the first layer.
  /// @param place of the layers, for messages: "mlp: layers".
  /// @throws Error if there is no layer or more than `kMaxLayers`, shapes do not fit together, a
  /// layer is wider than `kMaxUnits`, the last has not one output or is not linear, an activation is
  /// unknown, or a number is not finite.
  DenseStack(const std::vector<DenseLayer>& layers, std::size_t inputs, const std::string& place);

  /// @param input `padded_count(inputs)` aligned values, those beyond the inputs finite.
  float evaluate(const float* input) noexcept TORSIO_REALTIME;

  /// What the last layer saw in the last `evaluate(input)`.
  [[nodiscard]] std::span<const float> last_layer_input(const float* input) const noexcept {
    return {hidden_.empty() ? input : hidden_.back().output.data(), last_inputs_};
  }

 private:
  struct Hidden {
    std::size_t inputs = 0;
    std::size_t units = 0;
    std::size_t blocks = 0;
    Activation activation = Activation::linear;
    detail::AlignedVector<float> weights;  ///< layout: src/model/network/network_kernels.hpp
    detail::AlignedVector<float> output;   ///< from the last evaluation, padded
  };

  std::vector<Hidden> hidden_;
  detail::AlignedVector<float> last_weights_;  ///< padded
  std::size_t last_inputs_ = 0;
  float last_bias_ = 0.0F;
};

/// `count` rounded up to whole vectors of this machine.
[[nodiscard]] std::size_t padded_count(std::size_t count) noexcept;

}  // namespace torsio
