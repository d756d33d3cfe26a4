#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "model/common/linear_update.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model_adapter.hpp"
#include "torsio/model/network/network_layers.hpp"

namespace torsio {

/// Adapts the last layer of a network to a reference, sample by sample, while the other layers stay
/// constant.
///
/// With features h~ = [h; 1] of the last layer and its frozen weights W0 = [w; b], W h~ follows the
/// reference in standardised units by `LinearUpdate`. |W - W0| <= rho |W0|, by shrinking the
/// difference.
///
/// All in double. The stored state is W - W0: without updates the value is the network's, to the
/// bit. Source: paper 004, specification 3.4.
class LastLayerAdapter final : public ModelAdapter {
 public:
  /// @param last the network's last layer. @param target_scale of its `NetworkScaling`.
  /// @throws Error if a setting is out of range, all weights are 0, or there are more features than
  /// `kMaxRlsFeatures` for RLS.
  LastLayerAdapter(const AdaptationSettings& settings, const DenseLayer& last, double target_scale,
                   double sample_period_s);

  [[nodiscard]] std::unique_ptr<ModelAdapter> copy() const override {
    return std::make_unique<LastLayerAdapter>(*this);
  }

  /// @param features input of the last layer. @param frozen_value the network's output for them, in
  /// the target's unit. @returns the output with the adapted weights, or the frozen
  /// value if something is not finite.
  double step(std::span<const float> features, double frozen_value) noexcept TORSIO_REALTIME;
  Estimate step(const AnyModel& model, Features features,
                const Estimate& frozen) noexcept override TORSIO_REALTIME;

  /// |W - W0| / |W0|
  [[nodiscard]] double relative_change() const noexcept override;
  /// The layer with the weights as they are now, rounded to float32.
  [[nodiscard]] DenseLayer adapted() const;
  [[nodiscard]] AnyParameters adapted(AnyParameters base) const override;

 private:
  [[nodiscard]] UpdateOutcome update(double error) noexcept override;
  void restore() noexcept override { weights_.reset(); }

  DenseLayer frozen_;
  double bound_;          ///< on |W - W0|
  std::size_t features_;  ///< inputs of the last layer, without the 1
  detail::LinearUpdate weights_;
};

/// An adapter for a network's own last layer, or null if the family is none of `mlp`, `lstm`, `gru`.
/// @throws Error as `LastLayerAdapter`.
[[nodiscard]] std::unique_ptr<ModelAdapter> last_layer_adapter(const AdaptationSettings& settings,
                                                               const AnyParameters& network,
                                                               double sample_period_s);
[[nodiscard]] bool has_last_layer(const AnyParameters& parameters) noexcept;

}  // namespace torsio
