#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/estimate/estimator_core.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {
namespace detail {

/// One tick of an estimator, at which no gap ends.
template <Model M>
Estimate estimator_tick(EstimatorCore& core, M& model, std::span<const double> raw) noexcept {
  const detail::EstimatorCore::Conditioned input = core.condition(raw);
  if (input.fault != Fault::none) return core.held(input.fault);
  if (input.for_model.empty()) return core.apply_guards(input, {});
  if (input.restarted) model.reset();
  const Estimate raw_estimate = model.step(input.for_model);
  const bool is_finite = std::isfinite(raw_estimate.value);
  if (!is_finite) model.reset();
  if (!is_finite || raw_estimate.fault == Fault::model_not_finite) core.lose_memory();
  return core.apply_guards(input, raw_estimate);
}

/// One tick of an estimator.
template <Model M>
Estimate estimator_step(EstimatorCore& core, M& model, std::span<const double> raw) noexcept {
  for (std::size_t left = core.begin_interpolation(raw); left > 0; --left)
    estimator_tick(core, model, core.between(raw, left));
  return estimator_tick(core, model, raw);
}

}  // namespace detail

/// The estimator for a control loop: raw channels -> features -> model -> guards -> value with
/// error bar.
///
/// `value` is finite in every case. Within the training range of every feature it is the model's
/// alone, and beyond a border of the width `margin` the fault is `outside_training_range`. What the value
/// is outside is the verdict of `detail::EstimatorCore::Excursion`, which `ModelInverse` has, too:
///
/// - the model's in use: a rate of a spring beyond its range, which the model receives limited to it, and
///   the first input of a model that continues (`FamilyTraits::continues`), up to one width of the range
///   beyond. The error bar is that of the model times 1 + 2 s, with s the share of the width by which the
///   worst feature has left its range, and contains s |model - fallback| for the first one.
/// - a blend over the border, from the end of the range or of that width: the fallback's weight w grows
///   linearly with the worst feature's excursion, from 0 to 1, so that no value jumps; std_dev^2 = (1-w)
///   model's + w fallback's + w (1-w) (model - fallback)^2.
/// - the fallback's beyond, after a jump, and with the faults below where they state it.
///
/// Where `fault` is not `none`, the value must not be used as the model's. The first of these that holds is
/// reported; `outside_training_range` where the model is still in use comes last:
///
/// - `input_count_wrong`, `input_not_finite`: the tick cannot be used and nothing is stepped; the
///   last value from usable inputs (0 if none), without error bar.
/// - `wrong_rate`: see `set_wrong_rate`; linear fallback, without error bar.
/// - `zero_not_set`: a channel in `settings().zeroed_channels` had its zero taken from each record
///   in training, and `set_zero` was not called for it. The value is what it would be otherwise,
///   off by the slope times that zero, without error bar. It has priority over the range,
///   because the position of a channel without a zero is unknown.
/// - `outside_training_range`: a feature is beyond the border, or a raw input has changed by more than
///   `kJumpFactor` times its largest step in training: there is no evidence. The value as above; the linear
///   fallback has no error bar there.
/// - `warming_up`: filters have not settled since `reset()`, a long gap or a jump; linear fallback. An unknown
///   state of `stop` or `dahl` in the inputs is not a fault, but is contained in the error bar.
/// - `recovering`: inputs that the memory of the model has not received can still change its output by
///   more than its error bar (`MemoryError`); linear fallback.
/// - a fault that the model reported, or `model_not_finite` (the model is then reset); linear
///   fallback.
///
/// If the fallback overflows, the last value is held. After a gap of at most `kLongestGapSeconds`
/// (never less than one tick) filters and model receive interpolated inputs for the missing ticks, unless
/// they do not depend on past samples: this tick costs as many steps more. After a longer gap the
/// filters restart and warm up, and the model recovers. A jump that returns within that time is a gap. A
/// new level is used once it has lasted for that time and the features are inside their ranges; until then a
/// model with memory is not stepped. A continuous excursion is a motion: the model is stepped with the
/// features limited to their ranges and borders, or to where its value is used, and recovers from what may
/// have been wrong in it. A model without an error bar
/// gets one from the residual table.
template <Model M>
class BasicEstimator {
 public:
  /// @throws Error if settings and model do not fit together or a number in the settings is not
  /// finite.
  BasicEstimator(EstimatorSettings settings, M model)
      : core_(std::move(settings), model), model_(std::move(model)) {
    detail::StateHash hash;
    hash.add(core_.state_identity());
    hash.add(detail::state_identity_of(model_));
    state_identity_ = hash.value();
    reset();
  }

  /// The channels that `step` requires, in this order.
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return core_.raw_inputs();
  }
  [[nodiscard]] const EstimatorSettings& settings() const noexcept { return core_.settings(); }
  [[nodiscard]] M& model() noexcept { return model_; }
  [[nodiscard]] const M& model() const noexcept { return model_; }

  /// Subtracts `value` (SI) from a raw channel from now on, `reset()` or not. Call it while
  /// configuring: another zero in mid-run is a jump, from which filters and model recover.
  /// @throws UsageError for an unknown channel or a value that is not finite.
  void set_zero(std::string_view channel, double value) { core_.set_zero(channel, value); }
  /// The channels in `settings().zeroed_channels` for which `set_zero` was not called yet; while
  /// there are any, each step reports `Fault::zero_not_set`.
  [[nodiscard]] const std::vector<std::string>& unset_zeros() const noexcept {
    return core_.unset_zeros();
  }

  void reset() noexcept {
    core_.reset();
    model_.reset();
  }

  /// Whether filters and differentiators have settled, so that the model's value is used.
  [[nodiscard]] bool is_settled() const noexcept { return core_.is_settled(); }
  /// What the unknown states of `stop` and `dahl` in the inputs add to the error bar at present.
  [[nodiscard]] double start_std_dev() const noexcept { return core_.start_std_dev(); }

  /// From now on the ticks do not come at the sample rate (or do again): `Fault::wrong_rate`, unless
  /// neither the features nor the model depend on past samples.
  void set_wrong_rate(bool is_wrong) noexcept TORSIO_REALTIME { core_.set_wrong_rate(is_wrong); }

  /// So many ticks did not take place: the loop was late or stopped. For the next `step` they are a gap.
  void miss(double ticks) noexcept TORSIO_REALTIME { core_.miss(ticks); }

  /// @param raw one value for each of `raw_inputs()`; NaN for one that was not measured.
  Estimate step(std::span<const double> raw) noexcept TORSIO_REALTIME {
    return detail::estimator_step(core_, model_, raw);
  }

  /// A measurement of the last step's target, for a model that feeds its output back: free run
  /// starts from the measured value, or is one step ahead if called after each step.
  void correct(double measured) noexcept TORSIO_REALTIME
    requires FeedsBack<M>
  {
    model_.correct(measured);
  }

  /// The state as bytes, for a copy in time: everything that `reset` restarts (filters, lags, memory
  /// and guards), so that after `load` the steps give the same numbers to
  /// the bit. Zeros are configuration and not contained: set them first. The bytes are for the same
  /// build on the same kind of machine, not for an archive. No heap, no lock.
  /// @returns bytes that `save` writes, always as many; 0 for a model with memory whose family does not
  /// list it (`HasStateBytes`), as a model that is adapted
  [[nodiscard]] std::size_t state_size() const noexcept TORSIO_REALTIME {
    return detail::state_size(*this);
  }
  /// @param bytes `state_size()` of them. @returns false, without effect, if they are not as many or 0.
  [[nodiscard]] bool save(std::span<std::byte> bytes) const noexcept TORSIO_REALTIME {
    return detail::save_state(*this, state_identity_, bytes);
  }
  /// @returns false, without effect, for anything but a state that `save` wrote of an estimator with the
  /// same model and settings.
  [[nodiscard]] bool load(std::span<const std::byte> bytes) noexcept TORSIO_REALTIME {
    return detail::load_state(*this, state_identity_, bytes);
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept {
    bytes.visit(core_);
    detail::visit_state_of(model_, bytes);
  }
  /// Differs for the states of different models.
  [[nodiscard]] std::uint64_t state_identity() const noexcept { return state_identity_; }

 private:
  detail::EstimatorCore core_;
  M model_;
  std::uint64_t state_identity_ = 0;
};

}  // namespace torsio
