#pragma once

#include <algorithm>
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
/// short, by more than `kTolerance`; nor where their mean is too short by more than `kMeanTolerance`, in
/// which periods longer than two are two. A single late tick is not an error: `missed` counts the ticks that
/// did not take place before it.
class PeriodCheck {
 public:
  static constexpr double kTolerance = 0.2;  ///< share of the period
  static constexpr double kMeanTolerance = 0.4;
  static constexpr int kPeriods = 32;
  /// After a step back by more than a period it is not known how much time has passed.
  static constexpr double kUnknownTicks = 1e9;

  explicit PeriodCheck(double period_s) : period_s_(period_s) {}

  void reset() noexcept {
    too_short_ = 0;
    too_long_ = 0;
    mean_ = 1.0;
    late_ = 0.0;
    missed_ = 0.0;
    unstamped_ = 0;
    has_last_ = false;
  }

  /// @param t_s of this tick. Not finite: none; after 32 of them the check starts again.
  /// @returns whether the rate is wrong
  bool step(double t_s) noexcept TORSIO_REALTIME {
    missed_ = 0.0;
    if (!std::isfinite(t_s)) {
      if (++unstamped_ >= kPeriods) reset();
      return is_wrong();
    }
    const double ticks = 1.0 + static_cast<double>(unstamped_);
    const double passed = (t_s - last_s_) / period_s_;  // in periods
    last_s_ = t_s;
    unstamped_ = 0;
    if (!has_last_) {
      has_last_ = true;
      return false;
    }
    const double period = passed / ticks;
    too_short_ = too_short_ << 1U | static_cast<std::uint32_t>(period < 1.0 - kTolerance);
    too_long_ = too_long_ << 1U | static_cast<std::uint32_t>(period > 1.0 + kTolerance);
    mean_ += (std::clamp(period, 0.0, 2.0) - mean_) / kPeriods;
    count_missed(passed, ticks);
    return is_wrong();
  }
  /// Ticks that did not take place between the last one and the one before.
  [[nodiscard]] double missed() const noexcept { return missed_; }

  /// The members that change in a step.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(last_s_, too_short_, too_long_, mean_, late_, unstamped_, has_last_);
  }

 private:
  [[nodiscard]] bool is_wrong() const noexcept {
    return std::popcount(too_short_) > kPeriods / 2 || std::popcount(too_long_) > kPeriods / 2 ||
           mean_ < 1.0 - kMeanTolerance;
  }
  /// Jitter of the stamps by half a period misses nothing: only a whole period counts, and an early
  /// tick cancels a late one.
  void count_missed(double passed, double ticks) noexcept {
    if (passed < -1.0) {
      missed_ = kUnknownTicks;
      late_ = 0.0;
      return;
    }
    constexpr double kRounding = 1e-3;
    late_ = std::clamp(late_ + passed - ticks, -1.0, kUnknownTicks);
    missed_ = std::max(0.0, std::floor(late_ + kRounding));
    late_ -= missed_;
  }

  double period_s_;
  double last_s_ = 0.0;
  std::uint32_t too_short_ = 0;  ///< one bit per period, the newest last
  std::uint32_t too_long_ = 0;
  double mean_ = 1.0;  ///< mean of the last periods
  double late_ = 0.0;  ///< periods that have passed without a tick
  double missed_ = 0.0;
  std::uint32_t unstamped_ = 0;  ///< ticks since the last stamp
  bool has_last_ = false;
};

}  // namespace torsio::detail

namespace torsio {

/// An estimator that is fed with a joint's sample instead of a row of channels.
///
/// From `JointSample::t_s` it checks the rate of the loop (not where that is NaN): where the median of
/// the last 32 periods differs from the sample period by more than 20 %, filters and memory of the
/// model are wrong, and each step reports `Fault::wrong_rate`. Ticks that did not take place are a gap
/// (`BasicEstimator::miss`). A model and features that depend on the
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
    estimator_.miss(period_check_.missed());
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
