#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/estimate/joint_sample.hpp"
#include "torsio/estimate/period_check.hpp"

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

}  // namespace torsio
