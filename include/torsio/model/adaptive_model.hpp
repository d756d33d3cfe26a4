#pragma once

#include <cstddef>

#include "torsio/core/realtime.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/network/last_layer_adapter.hpp"

namespace torsio {

/// The last layer of a network's parameters, or null if the family is none of `mlp`, `lstm`, `gru`.
[[nodiscard]] const DenseLayer* last_layer(const AnyModel::Parameters& parameters) noexcept;
/// The same. @throws UsageError where there is none.
const DenseLayer& require_last_layer(const AnyModel::Parameters& parameters);

/// A network whose last layer can be adapted while it runs: a `Model`, so that it can be used
/// within an estimator's guards (`AdaptiveEstimator`).
class AdaptiveModel {
 public:
  struct Parameters {
    AnyModel::Parameters network;
    AdaptationSettings adaptation;
    double sample_period_s = 0.0;
  };

  /// @throws Error as the network's own family and `LastLayerAdapter`, or UsageError if the family
  /// has no last layer.
  explicit AdaptiveModel(const Parameters& parameters);

  /// The parameters of the frozen network.
  [[nodiscard]] Parameters parameters() const;
  [[nodiscard]] std::size_t input_count() const noexcept { return network_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return network_.parameter_count(); }

  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const {
    return network_.memory(ranges);
  }

  /// Resets the hidden state; the adapted weights are kept (`adapter().reset()` resets them).
  void reset() noexcept { network_.reset(); }
  /// The value of the adapted weights.
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  [[nodiscard]] LastLayerAdapter& adapter() noexcept { return adapter_; }
  [[nodiscard]] const LastLayerAdapter& adapter() const noexcept { return adapter_; }

  /// The network with the present weights: an ordinary model, to be saved.
  [[nodiscard]] AnyModel::Parameters adapted() const;

 private:
  AnyModel network_;
  LastLayerAdapter adapter_;
  double sample_period_s_;
};

}  // namespace torsio
