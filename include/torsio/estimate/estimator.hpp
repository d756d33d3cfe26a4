#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/estimator_core.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/model/any_model.hpp"
#include "torsio/model/model.hpp"

namespace torsio {

/// What runs in the loop: raw channels -> features -> model -> guards -> value with error bar.
///
/// `value` is finite in every case. Where `fault` is not `none` it does not come from the model:
///
/// | fault | when | value | std_dev |
/// |---|---|---|---|
/// | input_count_wrong, input_not_finite | tick unusable, nothing stepped | last good or 0 | NaN |
/// | warming_up | filters not settled since `reset()` or a long gap | fallback | fallback's (1) |
/// | outside_training_range | a feature left its range by more than the margin | fallback | NaN |
/// | model_not_finite | the model's value is NaN or infinite; it is reset | fallback | fallback's |
/// | any other | the model itself said so | fallback | fallback's |
///
/// fallback: the linear one. last good: the last value from usable inputs. (1): NaN outside the
/// training range, where there is no evidence.
///
/// Should the fallback overflow, the last value is held. After a gap of at most
/// `kLongestGapSeconds` (never less than one tick) filters and model run on as if the missing ticks
/// had not been, so a plain `rate(x)` shows the whole step over the gap in one tick; after a longer
/// one they start afresh and warm up. A model without an error bar of its own gets that of the
/// residual table.
///
/// Channels in `settings().zeroed_channels` had their zero taken from each record in training: set
/// it with `set_zero` before the first step, or the value is off by the slope times that zero.
template <Model M>
class BasicEstimator {
 public:
  /// @throws Error if settings and model do not fit together or a number in the settings is not
  /// finite.
  BasicEstimator(EstimatorSettings settings, M model)
      : core_(std::move(settings), model.input_count()), model_(std::move(model)) {
    reset();
  }

  /// The channels that `step` wants, in this order.
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return core_.raw_inputs();
  }
  [[nodiscard]] const EstimatorSettings& settings() const noexcept { return core_.settings(); }
  [[nodiscard]] const M& model() const noexcept { return model_; }

  /// Subtracts `value` (SI) from a raw channel from now on. Call it while configuring.
  /// @throws UsageError for an unknown channel or a value that is not finite.
  void set_zero(std::string_view channel, double value) { core_.set_zero(channel, value); }

  void reset() noexcept {
    core_.reset();
    model_.reset();
  }

  /// Whether filters and differentiators have settled, so that the model is listened to.
  [[nodiscard]] bool is_settled() const noexcept { return core_.is_settled(); }

  /// @param raw one value for each of `raw_inputs()`; NaN for one that was not measured.
  Estimate step(std::span<const double> raw) noexcept TORSIO_REALTIME {
    const EstimatorCore::Conditioned input = core_.condition(raw);
    if (input.fault != Fault::none) return core_.held(input.fault);
    if (input.restarted) model_.reset();
    const Estimate told = model_.step(input.features);
    if (!std::isfinite(told.value)) model_.reset();
    return core_.judge(input.features, told);
  }

 private:
  EstimatorCore core_;
  M model_;
};

/// An estimator around a model of any known family, as model files hold them.
using Estimator = BasicEstimator<AnyModel>;

}  // namespace torsio
