#include "fit/hammerstein_wiener/hammerstein_wiener_families.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <vector>

#include "fit/common/fitted_model.hpp"
#include "fit/hammerstein_wiener/fit_hammerstein_wiener.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Nothing is fitted: what does not fit the paper's units is refused.
FittedModel published(const TrainingData& data, Paper003 form) {
  HammersteinWiener::Parameters parameters = hammerstein_wiener_of(form, data.input_count());
  const double period_s = 1.0 / data.sample_rate_Hz;
  constexpr double kRounding = 1e-6;
  if (std::abs(period_s - parameters.sample_period_s) > kRounding * period_s)
    throw Error({.place = "published",
                 .problem = "the paper's coefficients hold at one sample rate",
                 .expected = "200 Hz",
                 .found = fmt::format("{:g} Hz", data.sample_rate_Hz),
                 .advice = "Resample the recordings with --rate 200."});
  if (!data.target.ends_with("_Nm"))
    throw Error({.place = "published", .expected = "a target in Nm", .found = data.target});
  parameters.sample_period_s = period_s;
  return {HammersteinWiener(std::move(parameters)),
          {fmt::format("the coefficients of paper 003, not fitted: {} in rad, X/W = {}",
                       data.inputs.front().expression, text_of(continuous_of(form)))},
          {}};
}

FittedModel fit(const TrainingData& data, const HammersteinWienerOptions& options,
                const FitContext& context) {
  if (options.published) return published(data, *options.published);
  return fitted_model(fit_hammerstein_wiener(data, options, context));
}

/// Its linear part in words.
ParameterDescription describe(const AnyParameters& parameters,
                              const EstimatorSettings& /*settings*/) {
  return {.lines = continuous_notes(parameters.get<HammersteinWiener::Parameters>())};
}

}  // namespace

std::vector<FamilyInfo> hammerstein_wiener_families() {
  return {family_of<fit>({.name = HammersteinWiener::kFamily,
                          .summary = "linear system between two curves, least error in free run",
                          .only_if_named = true,
                          .in_search = true,
                          .variations = {{"map", "piecewise_linear"}},
                          .typical_fit_s = 24.0,
                          .describe = describe})};
}

}  // namespace torsio
