#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/aligned_vector.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// Recurrent layers in series and their states for some joints that share the weights. The weights
/// are packed for the machine's vectors when constructed; a step reads them once, in order, for all
/// joints. A joint's values do not depend on the number of joints, to the bit.
///
/// @tparam Layer `LstmLayer` or `GruLayer`.
template <class Layer>
class RecurrentStack {
 public:
  /// @param inputs of the first layer.
  /// @param place of the layers, for messages: "lstm: layers".
  /// @throws Error if there is no layer or more than `kMaxLayers`, shapes do not fit together, a
  /// layer is wider than `kMaxUnits`, or a number is not finite.
  RecurrentStack(const std::vector<Layer>& layers, std::size_t inputs, std::size_t joints,
                 const std::string& place);

  [[nodiscard]] std::size_t joint_count() const noexcept { return joints_; }
  /// Outputs of the last layer.
  [[nodiscard]] std::size_t output_count() const noexcept { return layers_.back().units; }

  /// All joints to the zero state, or one.
  void reset() noexcept;
  void reset(std::size_t joint) noexcept;

  /// Values of the state of one joint: for each layer its h, then (LSTM) its c.
  [[nodiscard]] std::size_t state_size() const noexcept;
  void get_state(std::size_t joint, std::span<float> state) const noexcept TORSIO_REALTIME;
  void set_state(std::size_t joint, std::span<const float> state) noexcept TORSIO_REALTIME;

  /// @param inputs of joint 0, then of joint 1, and so on.
  void step(const float* inputs) noexcept TORSIO_REALTIME;

  /// h of the last layer, padded to whole vectors.
  [[nodiscard]] const float* output(std::size_t joint) const noexcept {
    return layers_.back().hidden.data() + joint * layers_.back().stride;
  }

  /// The members that change in a step, padding included: whatever vectors the machine has.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.refuse_list();  // a step exchanges the hidden state and its next one
    for (Packed& layer : layers_) bytes.visit(layer.hidden, layer.cell);
  }

 private:
  struct Packed {
    std::size_t inputs = 0;
    std::size_t units = 0;
    std::size_t stride = 0;                     ///< units, padded
    detail::AlignedVector<float> weights = {};  ///< layout: src/model/network/network_kernels.hpp
    detail::AlignedVector<float> hidden = {};   ///< joints x stride
    detail::AlignedVector<float> other_hidden = {};  ///< where a step writes the next h
    detail::AlignedVector<float> cell = {};          ///< joints x stride; empty for a GRU
    bool biases_apart = false;                       ///< `LstmLayer::keeps_biases_apart`
  };

  std::vector<Packed> layers_;
  std::size_t inputs_;
  std::size_t joints_;
};

extern template class RecurrentStack<LstmLayer>;
extern template class RecurrentStack<GruLayer>;

}  // namespace torsio
