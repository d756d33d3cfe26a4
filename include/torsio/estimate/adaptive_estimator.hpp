#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/estimator.hpp"
#include "torsio/model/adaptive_model.hpp"

namespace torsio {

/// An `Estimator` around a model that is trained further during operation (the last layer of a
/// network, a mixture, the coefficients of a grey box), from a reference sensor as long as there is
/// one. Each tick:
///
///     const Estimate torque = estimator.step(raw);         // before this tick's reference
///     estimator.learn({.value = load_cell_Nm, .age_s = age_s});
///
/// Where the estimate comes from a guard and not from the model (`fault` is not `none`), nothing
/// is learned. Nothing is allocated after construction.
class AdaptiveEstimator {
 public:
  /// @param base of a model file (`ModelFile::parameters`). @throws Error as `Estimator` and
  /// `AdaptiveModel`.
  AdaptiveEstimator(const EstimatorSettings& settings, const AnyModel::Parameters& base,
                    const AdaptationSettings& adaptation);

  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return estimator_.raw_inputs();
  }
  [[nodiscard]] const EstimatorSettings& settings() const noexcept { return estimator_.settings(); }
  /// As for the estimator.
  void set_zero(std::string_view channel, double value) { estimator_.set_zero(channel, value); }

  /// Resets filters and the state of the model; what was learned is kept.
  void reset() noexcept;
  /// Returns to the frozen model.
  void forget() noexcept { estimator_.model().adapter().reset(); }
  void pause() noexcept { estimator_.model().adapter().pause(); }
  void resume() noexcept { estimator_.model().adapter().resume(); }

  Estimate step(std::span<const double> raw) noexcept TORSIO_REALTIME;
  /// @param reference measured at the tick of the last `step`, with the zeros and unit of the
  /// model's target.
  UpdateOutcome learn(const ReferenceSample& reference) noexcept TORSIO_REALTIME;

  [[nodiscard]] const ModelAdapter& adapter() const noexcept {
    return estimator_.model().adapter();
  }
  /// The model as it is now, for a model file.
  [[nodiscard]] AnyModel::Parameters adapted() const { return estimator_.model().adapted(); }

 private:
  BasicEstimator<AdaptiveModel> estimator_;
  Fault last_fault_ = Fault::warming_up;
};

}  // namespace torsio
