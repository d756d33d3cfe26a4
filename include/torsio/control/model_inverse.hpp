#pragma once

#include <cstddef>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "torsio/control/spring_inverse.hpp"
#include "torsio/core/dispatch.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/estimate/estimator_core.hpp"
#include "torsio/estimate/joint_sample.hpp"
#include "torsio/estimate/torque_estimator.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// A model of the torque, inverted: δ = E[δ | τ*, δ̇, …] with everything but δ as measured
/// (`AnyModel::invert`; specification 3.1 for mixtures).
///
/// Guarded as an `Estimator` is, with its faults in its order and its verdict beyond the training range
/// (`EstimatorCore::Excursion`), but at the deflection that is requested, wherever the measured one is, and
/// with the linear fallback at a rate beyond its range.
/// Where the model is not used, and where it has no inverse, the result is that of the linear fallback.
/// With `outside_training_range` it must not be used but for a controlled stop, even where it is the
/// model's. A slow sweep contains no information about the fast motions of a torque loop
/// (specification 6), so the result may depart from the linear fallback only by so many of its residual
/// standard deviations, within the range and beyond it.
///
/// The memory of a model with state follows the deflection that is requested, not the measured one:
/// with the measured one it would interpret a joint that sticks as a spring that is stiff, and
/// request less the longer the joint sticks. `follow` reports the deflection that was really
/// requested after the limits of the loop. A model whose output is not finite is reset.
class ModelInverse {
 public:
  /// In residual standard deviations of the linear fallback.
  static constexpr double kMaxDeparture = 3.0;

  /// @throws Error as `Estimator`, or if the model's first input is not `spring_deflection_rad`,
  /// its target is not a torque in Nm, its family has no inverse, its fallback has no
  /// positive slope, or it needs a channel that a `JointSample` does not have.
  ModelInverse(EstimatorSettings settings, AnyModel model, double max_departure = kMaxDeparture);

  /// As `Estimator::set_zero`.
  void set_zero(std::string_view channel, double value) { core_.set_zero(channel, value); }

  void reset() noexcept;
  Estimate step(double torque_Nm, const JointSample& sample) noexcept TORSIO_REALTIME;
  /// @param asked_rad the deflection that the loop requests instead of the last result; without a
  /// call, that
  void follow(double asked_rad) noexcept TORSIO_REALTIME {
    if (follows_answer_) asked_.front() = asked_rad - zero_rad_;
  }

 private:
  using Core = detail::EstimatorCore;

  void store(Features features) noexcept;
  [[nodiscard]] double on_the_line(double torque_Nm, Features features) const noexcept;
  Estimate guarded(double torque_Nm, const Core::Conditioned& input) noexcept;

  Core core_;
  AnyModel model_;
  detail::JointInputs inputs_;
  double max_departure_rad_;
  bool is_stepped_;
  std::vector<double> asked_;  ///< features of this tick, with the resulting deflection
  bool is_asked_ = false;      ///< the memory has not been updated with it yet
  bool follows_answer_ = false;
  double zero_rad_ = 0.0;  ///< the measured deflection less the model's, of this tick
  double last_rad_ = 0.0;
};

/// An inverse model from training: its target is `spring_deflection_rad`, and `torque_Nm` is among
/// its inputs; guarded by its own estimator.
class TrainedInverse {
 public:
  /// @throws Error if its target is not `spring_deflection_rad`, `torque_Nm` is not among its raw
  /// inputs, another is not in a `JointSample`, or a channel from which its target is
  /// computed was zeroed in training: its deflection would differ from the measured one by
  /// zeros that it does not know.
  explicit TrainedInverse(Estimator estimator);

  void set_zero(std::string_view channel, double value) { estimator_.set_zero(channel, value); }
  void reset() noexcept { estimator_.reset(); }
  Estimate step(double torque_Nm, const JointSample& sample) noexcept TORSIO_REALTIME;

 private:
  Estimator estimator_;
  std::size_t torque_;  ///< its place among the raw inputs
  detail::JointInputs others_;
  std::vector<double> raw_;
};

/// Any of the above, as a file specifies.
class AnyInverse {
 public:
  AnyInverse(LinearInverse inverse) : inverse_(inverse) {}
  AnyInverse(ModelInverse inverse) : inverse_(std::move(inverse)) {}
  AnyInverse(TrainedInverse inverse) : inverse_(std::move(inverse)) {}
  /// A model file's inverse: `TrainedInverse` if its target is the deflection, else `ModelInverse`.
  /// @throws Error as these do.
  [[nodiscard]] static AnyInverse of(const EstimatorSettings& settings,
                                     const AnyModel::Parameters& parameters);

  /// As `Estimator::set_zero`; without effect on a linear spring.
  void set_zero(std::string_view channel, double value);
  void reset() noexcept {
    detail::dispatch(inverse_, [](auto& inverse) { inverse.reset(); });
  }
  Estimate step(double torque_Nm, const JointSample& sample) noexcept TORSIO_REALTIME {
    return detail::dispatch(inverse_,
                            [&](auto& inverse) { return inverse.step(torque_Nm, sample); });
  }
  void follow(double asked_rad) noexcept TORSIO_REALTIME {
    if (auto* const model = std::get_if<ModelInverse>(&inverse_)) model->follow(asked_rad);
  }

 private:
  std::variant<LinearInverse, ModelInverse, TrainedInverse> inverse_;
};

}  // namespace torsio
