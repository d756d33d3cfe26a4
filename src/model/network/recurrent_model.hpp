#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "model/network/recurrent_network.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// A network with memory: recurrent layers, then dense ones, evaluated in float32.
///
/// One call is one sample: the state continues from call to call (specification 3.4, streaming a).
/// It starts at zero, and until `warm_up_samples` steps after a reset the value carries
/// `Fault::warming_up`. A discrete model: it runs only at the sample period that it was trained at.
/// Cost: its weights are read once from cache. Nothing is allocated after construction.
///
/// @tparam RecurrentLayer `LstmLayer` or `GruLayer`.
template <class RecurrentLayer>
class RecurrentModel {
 public:
  static constexpr std::string_view kFamily = RecurrentLayer::kFamily;
  using Layer = RecurrentLayer;
  using Parameters = RecurrentParameters<Layer>;

  /// @throws Error if there is no layer, shapes do not fit together, the last layer has not one output
  /// or is not linear, an activation is unknown, a number is not finite, or a scale or the period is
  /// not positive.
  explicit RecurrentModel(Parameters parameters)
      : parameters_(std::move(parameters)), network_(parameters_, 1, kFamily) {}

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return network_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept {
    return weight_count(parameters_.layers) + weight_count(parameters_.head);
  }
  [[nodiscard]] double sample_period() const noexcept {
    return parameters_.sample_period_s;
  }  ///< [s]

  /// Not declared: the state has no form that gives a bound.
  [[nodiscard]] static ModelMemory memory(const InputRanges& /*ranges*/) {
    return {.is_declared = false};
  }

  /// To the zero state.
  void reset() noexcept { network_.reset(0); }

  /// The state of the network: for each layer its h, then its c if it has one; `state_size()`
  /// values.
  [[nodiscard]] std::size_t state_size() const noexcept { return network_.state_size(); }
  void get_state(std::span<float> state) const noexcept TORSIO_REALTIME {
    network_.get_state(0, state);
  }
  /// Resets to a state from `get_state` or from training; it counts as warmed up.
  void reset(std::span<const float> state) noexcept TORSIO_REALTIME {
    network_.set_state(0, state);
  }

  /// A value that is not finite is given back as it is; so are then those after it, until a reset.
  Estimate step(Features features) noexcept TORSIO_REALTIME {
    Estimate estimate;
    network_.step(features, {&estimate, 1});
    return estimate;
  }

  /// What the last layer saw in the last step: what an adaptation of that layer learns from.
  [[nodiscard]] std::span<const float> last_layer_input() const noexcept {
    return network_.last_layer_input(0);
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(network_); }

 private:
  Parameters parameters_;
  RecurrentNetwork<Layer> network_;
};

}  // namespace torsio
