#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio::detail {

/// After a gap in the inputs that is longer than this, filters and model are reset; over a shorter
/// one they continue as if its ticks did not exist.
inline constexpr double kLongestGapSeconds = 0.01;

/// The part of an estimator that does not depend on the family of its model: from raw channels to
/// features, and the guards that decide whether the model's output may be used.
class EstimatorCore {
 public:
  /// @throws Error if the settings contradict each other or the model, or a number in them is not
  /// finite.
  EstimatorCore(EstimatorSettings settings, std::size_t model_input_count);

  /// One tick's raw channels after the pipeline.
  struct Conditioned {
    Features features;          ///< empty where `fault` is not none
    Fault fault = Fault::none;  ///< none, input_count_wrong or input_not_finite
    bool restarted = false;     ///< the pipeline was reset: the model's memory is invalid too
  };

  [[nodiscard]] const EstimatorSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return pipeline_.raw_inputs();
  }
  [[nodiscard]] bool is_settled() const noexcept { return pipeline_.is_settled(); }

  void set_zero(std::string_view channel, double value);
  [[nodiscard]] const std::vector<std::string>& unset_zeros() const noexcept {
    return unset_zeros_;
  }
  void reset() noexcept;

  Conditioned condition(std::span<const double> raw) noexcept TORSIO_REALTIME;
  /// The last value from good inputs, with the reason why it is held.
  [[nodiscard]] Estimate held(Fault fault) const noexcept TORSIO_REALTIME;
  /// How far the worst feature has left its range, in widths of its border: 0 inside, above 1
  /// beyond the border.
  [[nodiscard]] double excursion(Features features) const noexcept TORSIO_REALTIME;
  /// Applies the guards to `raw_estimate`, the model's output for `features`.
  Estimate apply_guards(Features features, const Estimate& raw_estimate) noexcept TORSIO_REALTIME;

 private:
  struct Range {
    double lowest = 0.0;
    double highest = 0.0;
    double border = 0.0;  ///< width, on either side, of the transition to the fallback
  };

  [[nodiscard]] Estimate model_part(const Estimate& raw_estimate) const noexcept;
  /// Blends `raw_estimate` with the fallback, whose share is `weight` in 0..1.
  [[nodiscard]] Estimate blended(Features features, const Estimate& raw_estimate,
                                 double weight) const noexcept;
  [[nodiscard]] double fallback_value(Features features) const noexcept;
  [[nodiscard]] double residual_std_at(double value) const noexcept;
  Conditioned miss(Fault fault) noexcept;

  EstimatorSettings settings_;
  FeaturePipeline pipeline_;
  std::vector<Range> ranges_;  ///< per feature, tolerance included
  std::vector<std::string> unset_zeros_;
  std::size_t longest_gap_;  ///< ticks
  std::size_t missed_ = 0;   ///< ticks in a row without usable input
  bool poisoned_ = false;    ///< a feature was not finite: differences and lags still contain it
  double last_value_ = 0.0;
};

}  // namespace torsio::detail
