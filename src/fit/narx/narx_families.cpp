#include "fit/narx/narx_families.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fit/common/fitted_model.hpp"
#include "fit/gaussian_process/fit_gaussian_process.hpp"
#include "fit/gaussian_process/fit_parametric_gp.hpp"
#include "fit/gaussian_process/fit_parametric_gp_paper.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/narx/fit_narx.hpp"
#include "fit/narx/fit_narx_polynomial.hpp"
#include "fit/narx/narx_run.hpp"
#include "fit/network/fit_network.hpp"
#include "fit/network/network_members.hpp"
#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/network/lstm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// The options of the feedback, then those of the fitter of f.
template <class Inner>
struct WithFeedback {
  NarxOptions narx = {};
  Inner inner = {};

  template <class Self, class Visit>
  static void visit_options(Self& self, const Visit& visit) {
    NarxOptions::visit_options(self.narx, visit);
    Inner::visit_options(self.inner, visit);
  }
};

/// f of the family M as a NARX model.
template <class M>
AnyModel wrapped(const AnyModel& f, const Narx<Linear>::Parameters& rest) {
  return Narx<M>(framed<M>(f.get_if<M>()->parameters(), rest));
}

/// @tparam kFit trains an M.
template <class M, auto kFit>
FittedModel narx(const TrainingData& data, const WithFeedback<detail::OptionsOf<kFit>>& options,
                 const FitContext& context) {
  return fit_narx(data, options.narx,
                  {.fit =
                       [&](const TrainingData& table, const FitContext& own) {
                         FittedModel f = detail::fit_with<kFit>(table, options.inner, own);
                         if (f.model.template get_if<M>() == nullptr)
                           throw UsageError({.place = "option members",
                                             .expected = "1 inside a NARX model",
                                             .found = std::string(f.model.family())});
                         return f;
                       },
                   .wrap = wrapped<M>},
                  context);
}

/// The difference equation as text.
ParameterDescription describe_equation(const AnyParameters& parameters,
                                       const EstimatorSettings& settings) {
  return {.lines = {equation_of(parameters.get<Narx<MultivariatePolynomial>::Parameters>(),
                                settings.features.inputs, settings.target)}};
}

/// @param variations what a structure search tries; empty: it leaves the family out
template <class M, auto kFit>
FamilyInfo narx_family(std::string_view summary, std::string_view name = Narx<M>::kFamily,
                       // It is moved, which clang-tidy does not see in a template.
                       // NOLINTNEXTLINE(performance-unnecessary-value-param)
                       std::vector<OptionVariation> variations = {}) {
  const bool in_search = !variations.empty();
  return family_of<narx<M, kFit>>({.name = name,
                                   .summary = summary,
                                   .model_family = Narx<M>::kFamily,
                                   .only_if_named = true,
                                   .in_search = in_search,
                                   .variations = std::move(variations),
                                   .typical_fit_s = 20.0});
}

}  // namespace

std::vector<FamilyInfo> narx_families() {
  return {family_of<fit_arx>(
              {.name = "arx",
               .summary = "line over inputs and its own past output, least error in free run",
               .model_family = Narx<Linear>::kFamily,
               .only_if_named = true,
               .in_search = true,
               .variations = {{"output_lags", "1"}, {"output_lags", "4"}}}),
          family_of<fit_narx_polynomial>(
              {.name = Narx<MultivariatePolynomial>::kFamily,
               .summary = "few products of inputs and its own past output, chosen one by one",
               .only_if_named = true,
               .in_search = true,
               .variations = {{"degree", "2"}},
               .describe = describe_equation}),
          narx_family<Dgmm, fit_dgmm>("Gaussian mixture that hears its own past output"),
          narx_family<Mlp, fit_members<fit_mlp, fit_mlp_ensemble, MlpOptions>>(
              "neural network that hears its own past output"),
          narx_family<Lstm, fit_members<fit_lstm, fit_lstm_ensemble, RecurrentOptions>>(
              "LSTM that hears its own past output"),
          narx_family<GaussianProcess, fit_gaussian_process>(
              "exact Gaussian process that hears its own past output"),
          narx_family<ParametricGp, fit_parametric_gp>(
              "Gaussian process at a few inducing points that hears its own past output",
              Narx<ParametricGp>::kFamily,
              // What paper 002 chose by trial in section III-C: clusters and lags, one at a time.
              {{"inducing_points", "7"},
               {"inducing_points", "28"},
               {"input_lags", "7"},
               {"output_lags", "7"}}),
          narx_family<ParametricGp, fit_parametric_gp_paper>(
              "the same by Algorithm 1 of paper 002 as printed, for comparison",
              "narx_parametric_gp_paper"),
          narx_family<ParametricGp, fit_variational_gp>(
              "the same by a variational bound, in closed form", "narx_parametric_gp_variational")};
}

}  // namespace torsio
