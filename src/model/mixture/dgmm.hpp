#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "model/mixture/gaussian_mixture.hpp"
#include "model/mixture/mixture_regression.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio {

/// Limits a mixture's output around the linear model where training data were sparse.
///
///     line(z) = intercept + slope . z
///     limit(z) = width max(1, p(z) / p_thin)
/// The output stays within line +- limit. It may depart from the linear model by `width` where the
/// density of the inputs is at or below p_thin, and by more where it is higher; in dense regions
/// the limit has no effect.
/// means nothing.
struct LinearClamp {
  double intercept = 0.0;                 ///< target's unit
  std::vector<double> slope;              ///< [inputs], target's unit over the input's
  double width = 0.0;                     ///< target's unit; 0: no clamp
  double thin_log_density = 0.0;          ///< ln p_thin of the inputs
  double thin_log_density_inverse = 0.0;  ///< the same of target and other inputs, for `invert`

  template <class Self, class Visit>
  static void visit_fields(Self& self, Visit&& visit) {
    visit("intercept", self.intercept);
    visit("slope", self.slope);
    visit("width", self.width);
    visit("thin_log_density", self.thin_log_density);
    visit("thin_log_density_inverse", self.thin_log_density_inverse);
  }
};

/// Dynamic Gaussian mixture model: the joint density of target and inputs, learned sample by
/// sample, and conditioned on the known quantities.
///
///     value = E[target | inputs]
///     std_dev^2 = E[(target - value)^2 | inputs]
///     novelty = -ln p(z~)
///
/// p(z~) is the density of the standardised inputs, so novelty has no unit. The same mixture also
/// estimates the first input from the target and the other inputs.
///
/// Source: papers 000 and 001, corrected in specification 1 and 3.1. Cost: see
/// `MixtureRegression::query`.
class Dgmm {
 public:
  static constexpr std::string_view kFamily = "dgmm";

  struct Parameters {
    using Family = Dgmm;
    GaussianMixture mixture;  ///< quantities: target, then the inputs in their order
    LinearClamp clamp;

    template <class Self, class Visit>
    static void visit_fields(Self& self, Visit&& visit) {
      visit("mixture", self.mixture);
      visit("clamp", self.clamp);
    }
  };

  /// @throws Error naming the component and what is wrong with it (see `check(GaussianMixture)`),
  /// or the field of the clamp.
  explicit Dgmm(Parameters parameters);

  [[nodiscard]] const Parameters& parameters() const noexcept { return parameters_; }
  [[nodiscard]] std::size_t input_count() const noexcept { return forward_.input_count(); }
  [[nodiscard]] std::size_t parameter_count() const noexcept;

  void reset() noexcept {}
  Estimate step(Features features) noexcept TORSIO_REALTIME;

  /// The estimate of a conditional distribution of the target: limited as that of `step`.
  [[nodiscard]] Estimate estimate_of(const Conditional& given,
                                     Features features) const noexcept TORSIO_REALTIME;

  /// The first input for which the target would be `target`, the other inputs as in `features`
  /// (`features[0]` is ignored): E[input 0 | target, inputs 1...], with error bar and novelty as in
  /// `step`. Without density there, the value of the linear model is returned with
  /// `Fault::model_not_finite`.
  [[nodiscard]] Estimate invert(double target, Features features) noexcept TORSIO_REALTIME;

 private:
  Parameters parameters_;
  MixtureRegression forward_;
  MixtureRegression inverse_;
  std::vector<double> inverse_inputs_;
};

}  // namespace torsio
