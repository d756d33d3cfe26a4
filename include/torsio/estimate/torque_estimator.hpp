#pragma once

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/estimate/joint_sample.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio::detail {

/// Whether a loop runs at the sample period that it was configured for, from the time stamps of its
/// ticks: it does not where more than half of the last 32 periods are too long, or more than half too
/// short, by more than `kTolerance`; so the median is off by as much. A single late tick is not an error.
class PeriodCheck {
 public:
  static constexpr double kTolerance = 0.2;  ///< share of the period
  static constexpr int kPeriods = 32;

  explicit PeriodCheck(double period_s)
      : shortest_s_((1.0 - kTolerance) * period_s), longest_s_((1.0 + kTolerance) * period_s) {}

  void reset() noexcept {
    too_short_ = 0;
    too_long_ = 0;
    has_last_ = false;
  }

  /// @param t_s of this tick; NaN, or before the last one: the check starts again.
  /// @returns whether the rate is wrong
  bool step(double t_s) noexcept TORSIO_REALTIME {
    const double period_s = t_s - last_s_;
    last_s_ = t_s;
    if (!has_last_ || !(period_s >= 0.0)) {
      reset();
      has_last_ = !std::isnan(t_s);
      return false;
    }
    too_short_ = too_short_ << 1U | static_cast<std::uint32_t>(period_s < shortest_s_);
    too_long_ = too_long_ << 1U | static_cast<std::uint32_t>(period_s > longest_s_);
    return std::popcount(too_short_) > kPeriods / 2 || std::popcount(too_long_) > kPeriods / 2;
  }

  /// The members that change in a step.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(last_s_, too_short_, too_long_, has_last_);
  }

 private:
  double shortest_s_;
  double longest_s_;
  double last_s_ = 0.0;
  std::uint32_t too_short_ = 0;  ///< one bit per period, the newest last
  std::uint32_t too_long_ = 0;
  bool has_last_ = false;
};

}  // namespace torsio::detail

namespace torsio {

/// An estimator that is fed with a joint's sample instead of a row of channels.
///
/// From `JointSample::t_s` it checks the rate of the loop (not where that is NaN): where the median of
/// the last 32 periods differs from the sample period by more than 20 %, filters and memory of the
/// model are wrong, and each step reports `Fault::wrong_rate`. A model and features that depend on the
/// present sample only run at any rate.
template <Model M>
class BasicTorqueEstimator {
 public:
  /// @throws Error as `JointInputs` does.
  explicit BasicTorqueEstimator(BasicEstimator<M> estimator)
      : estimator_(std::move(estimator)),
        inputs_(estimator_.raw_inputs(), estimator_.settings().target),
        period_check_(1.0 / estimator_.settings().sample_rate_Hz) {}

  [[nodiscard]] BasicEstimator<M>& estimator() noexcept { return estimator_; }
  [[nodiscard]] const BasicEstimator<M>& estimator() const noexcept { return estimator_; }

  void reset() noexcept {
    estimator_.reset();
    period_check_.reset();
  }

  /// As the estimator's: a zero of one of its `raw_inputs()`, in SI.
  void set_zero(std::string_view channel, double value) { estimator_.set_zero(channel, value); }

  /// `value` and `std_dev` in Nm.
  Estimate step(const JointSample& sample) noexcept TORSIO_REALTIME {
    estimator_.set_wrong_rate(period_check_.step(sample.t_s));
    return estimator_.step(inputs_.from(sample));
  }

  /// The state as bytes, as `BasicEstimator::state_size`, `save` and `load`, with the check of the rate.
  /// A state of the estimator in it is another one.
  [[nodiscard]] std::size_t state_size() const noexcept TORSIO_REALTIME {
    return detail::state_size(*this);
  }
  [[nodiscard]] bool save(std::span<std::byte> bytes) const noexcept TORSIO_REALTIME {
    return detail::save_state(*this, estimator_.state_identity(), bytes);
  }
  [[nodiscard]] bool load(std::span<const std::byte> bytes) noexcept TORSIO_REALTIME {
    return detail::load_state(*this, estimator_.state_identity(), bytes);
  }

  /// The members that change in a step.
  void visit_state(detail::StateBytes& bytes) noexcept { bytes.visit(estimator_, period_check_); }

 private:
  BasicEstimator<M> estimator_;
  detail::JointInputs inputs_;
  detail::PeriodCheck period_check_;
};

/// An estimator around a model whose family is known only at run time, as in model files.
using Estimator = BasicEstimator<AnyModel>;

/// The same, for a joint's sample as input.
using TorqueEstimator = BasicTorqueEstimator<AnyModel>;

}  // namespace torsio
