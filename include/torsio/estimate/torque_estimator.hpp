#pragma once

#include <string_view>
#include <utility>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/estimate/joint_sample.hpp"

namespace torsio {

/// An estimator that is fed with a joint's sample instead of a row of channels.
template <Model M>
class BasicTorqueEstimator {
 public:
  /// @throws Error as `JointInputs` does.
  explicit BasicTorqueEstimator(BasicEstimator<M> estimator)
      : estimator_(std::move(estimator)),
        inputs_(estimator_.raw_inputs(), estimator_.settings().target) {}

  [[nodiscard]] BasicEstimator<M>& estimator() noexcept { return estimator_; }
  [[nodiscard]] const BasicEstimator<M>& estimator() const noexcept { return estimator_; }

  void reset() noexcept { estimator_.reset(); }

  /// As the estimator's: a zero of one of its `raw_inputs()`, in SI.
  void set_zero(std::string_view channel, double value) { estimator_.set_zero(channel, value); }

  /// `value` and `std_dev` in Nm.
  Estimate step(const JointSample& sample) noexcept TORSIO_REALTIME {
    return estimator_.step(inputs_.from(sample));
  }

 private:
  BasicEstimator<M> estimator_;
  detail::JointInputs inputs_;
};

}  // namespace torsio
