#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "torsio/core/realtime.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/model/common/model_adapter.hpp"

namespace torsio {

/// @throws UsageError unless the family can be adapted: `mlp`, `lstm`, `gru`, `dgmm` or `grey_box`.
void require_adaptable(const AnyModel::Parameters& parameters);

/// A model that can be adapted while it runs (the last layer of a network, a mixture, the
/// coefficients of a grey box): a `Model`, so that it can be used within an estimator's guards
/// (`AdaptiveEstimator`).
class AdaptiveModel {
 public:
  struct Parameters {
    AnyModel::Parameters base;
    AdaptationSettings adaptation;
    double sample_period_s = 0.0;
  };

  /// @throws Error as the model's own family and its adapter, or as `require_adaptable`.
  explicit AdaptiveModel(const Parameters& parameters);
  AdaptiveModel(const AdaptiveModel& other);
  AdaptiveModel& operator=(const AdaptiveModel& other);
  AdaptiveModel(AdaptiveModel&&) noexcept = default;
  AdaptiveModel& operator=(AdaptiveModel&&) noexcept = default;
  ~AdaptiveModel() = default;

  /// The parameters of the frozen model.
  [[nodiscard]] Parameters parameters() const;
  [[nodiscard]] std::size_t input_count() const noexcept { return model_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept { return model_.parameter_count(); }

  [[nodiscard]] FamilyTraits traits() const noexcept { return model_.traits(); }
  [[nodiscard]] ModelMemory memory(const InputRanges& ranges) const {
    return model_.memory(ranges);
  }
  [[nodiscard]] std::uint64_t state_identity() const noexcept { return model_.state_identity(); }

  /// Resets the model's state; what was learned is kept (`adapter().reset()` resets it).
  void reset() noexcept { model_.reset(); }
  /// The estimate of the adapted parameters.
  Estimate step(Features features) noexcept TORSIO_REALTIME {
    first_feature_ = features.empty() ? kNotMeasured : features.front();
    return adapter_->step(model_, features, model_.step(features));
  }
  /// The first feature of the last step, by convention the deflection.
  [[nodiscard]] double first_feature() const noexcept { return first_feature_; }

  [[nodiscard]] ModelAdapter& adapter() noexcept { return *adapter_; }
  [[nodiscard]] const ModelAdapter& adapter() const noexcept { return *adapter_; }

  /// The model with the present parameters: an ordinary one, to be saved.
  [[nodiscard]] AnyModel::Parameters adapted() const;

 private:
  AnyModel model_;
  std::unique_ptr<ModelAdapter> adapter_;
  double sample_period_s_;
  double first_feature_ = kNotMeasured;
};

}  // namespace torsio
