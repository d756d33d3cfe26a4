#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "core/aligned_vector.hpp"
#include "model/network/dense_stack.hpp"
#include "model/network/recurrent_stack.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

template <class RecurrentLayer>
class RecurrentModel;

/// The parameters of a network with memory: recurrent layers, then dense ones.
template <class Layer>
struct RecurrentParameters {
  using Family = RecurrentModel<Layer>;
  NetworkScaling scaling;
  std::vector<Layer> layers;
  std::vector<DenseLayer> head;
  double sample_period_s = 0.0;
  std::size_t warm_up_samples = 0;

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("scaling", self.scaling);
    visit("layers", self.layers);
    visit("head", self.head);
    visit("sample_period_s", self.sample_period_s);
    visit("warm_up_samples", self.warm_up_samples);
  }
  bool operator==(const RecurrentParameters&) const = default;
};

/// One network, and the states of some joints that share it. A step reads the weights once for all
/// joints: each gets the value that a network of its own would give it, to the bit, for a fraction of
/// the time. `Lstm` and `Gru` are the networks of one joint.
template <class Layer>
class RecurrentNetwork {
 public:
  /// @param family for messages.
  /// @throws Error as `RecurrentStack` and `DenseStack`, or for a scale or period that is not
  /// positive and finite, or a centre that is not finite.
  RecurrentNetwork(const RecurrentParameters<Layer>& parameters, std::size_t joints,
                   std::string_view family);

  [[nodiscard]] std::size_t input_count() const noexcept { return scaling_.inputs.centre.size(); }
  [[nodiscard]] std::size_t joint_count() const noexcept { return stack_.joint_count(); }

  void reset() noexcept;
  void reset(std::size_t joint) noexcept;
  [[nodiscard]] std::size_t state_size() const noexcept { return stack_.state_size(); }
  void get_state(std::size_t joint, std::span<float> state) const noexcept TORSIO_REALTIME {
    stack_.get_state(joint, state);
  }
  void set_state(std::size_t joint, std::span<const float> state) noexcept TORSIO_REALTIME;

  /// @param features joints x inputs, row by row. @param estimates one per joint.
  void step(std::span<const double> features,
            std::span<Estimate> estimates) noexcept TORSIO_REALTIME;

  [[nodiscard]] std::span<const float> last_layer_input(std::size_t joint) const noexcept {
    return head_.last_layer_input(stack_.output(joint));
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(stack_);
    for (std::size_t& steps : steps_) bytes.visit_at_most(steps, warm_up_samples_);
  }

 private:
  NetworkScaling scaling_;
  RecurrentStack<Layer> stack_;
  DenseStack head_;
  std::size_t warm_up_samples_;
  detail::AlignedVector<float> inputs_;  ///< joints x inputs, standardised
  std::vector<std::size_t> steps_;       ///< per joint since its reset, up to `warm_up_samples_`
};

extern template class RecurrentNetwork<LstmLayer>;
extern template class RecurrentNetwork<GruLayer>;

}  // namespace torsio
