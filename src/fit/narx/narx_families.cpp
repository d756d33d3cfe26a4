#include "fit/narx/narx_families.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fit/common/fitted_model.hpp"
#include "fit/narx/fit_narx.hpp"
#include "fit/narx/fit_narx_polynomial.hpp"
#include "fit/narx/narx_run.hpp"
#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/mixture/dgmm.hpp"
#include "model/network/mlp.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// The families of f, as given to `narx_families`: a row's fitter is a plain function, so it cannot
/// contain the fitter of f itself.
std::vector<FamilyInfo>& inner_families() {
  static std::vector<FamilyInfo> families;
  return families;
}

const FamilyInfo& inner_family(std::string_view name) {
  return *std::ranges::find(inner_families(), name, &FamilyInfo::name);
}

/// f of the family M as a NARX model.
template <class M>
AnyModel wrapped(const AnyModel& f, const Narx<Linear>::Parameters& rest) {
  return Narx<M>(framed<M>(f.get_if<M>()->parameters(), rest));
}

/// @param family that trains an M; M's own, or a second way
template <class M>
FittedModel narx_by(std::string_view family, const TrainingData& data, const Options& options,
                    const FitContext& context) {
  const FamilyInfo& inner = inner_family(family);
  return fit_narx(data, filled<NarxOptions>(options),
                  {.fit =
                       [&](const TrainingData& table, const FitContext& own) {
                         FittedModel f = inner.fit(table, options, own);
                         if (f.model.template get_if<M>() == nullptr)
                           throw UsageError({.place = "option members",
                                             .expected = "1 inside a NARX model",
                                             .found = std::string(f.model.family())});
                         return f;
                       },
                   .wrap = wrapped<M>},
                  context);
}

template <class M>
FittedModel narx(const TrainingData& data, const Options& options, const FitContext& context) {
  return narx_by<M>(M::kFamily, data, options, context);
}

constexpr std::string_view kVariational = "parametric_gp_variational";

FittedModel narx_variational(const TrainingData& data, const Options& options,
                             const FitContext& context) {
  return narx_by<ParametricGp>(kVariational, data, options, context);
}

/// The difference equation as text.
ParameterDescription describe_equation(const AnyParameters& parameters,
                                       const EstimatorSettings& settings) {
  return {.lines = {equation_of(parameters.get<Narx<MultivariatePolynomial>::Parameters>(),
                                settings.features.inputs, settings.target)}};
}

struct NarxFamily {
  std::string_view name;
  std::string_view inner;
  std::string_view model_family;
  std::string_view summary;
  FittedModel (*fit)(const TrainingData&, const Options&, const FitContext&);
};

template <class M>
constexpr NarxFamily narx_family(std::string_view summary) {
  return {Narx<M>::kFamily, M::kFamily, Narx<M>::kFamily, summary, narx<M>};
}

constexpr std::array kNarxFamilies{
    narx_family<Dgmm>("Gaussian mixture that hears its own past output"),
    narx_family<Mlp>("neural network that hears its own past output"),
    narx_family<GaussianProcess>("exact Gaussian process that hears its own past output"),
    narx_family<ParametricGp>(
        "Gaussian process at a few inducing points that hears its own past output"),
    NarxFamily{"narx_parametric_gp_variational", kVariational, Narx<ParametricGp>::kFamily,
               "the same by a variational bound, in closed form", narx_variational}};

std::vector<OptionInfo> options_with(std::span<const OptionInfo> inner) {
  const auto own = options_of<NarxOptions>();
  std::vector<OptionInfo> all(own.begin(), own.end());
  all.insert(all.end(), inner.begin(), inner.end());
  return all;
}

}  // namespace

std::vector<FamilyInfo> narx_families(std::span<const FamilyInfo> known) {
  static std::array<std::vector<OptionInfo>, kNarxFamilies.size()> options;
  inner_families().assign(known.begin(), known.end());
  std::vector<FamilyInfo> families{
      family_of<fit_arx>(
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
           .describe = describe_equation})};
  for (std::size_t i = 0; i < kNarxFamilies.size(); ++i) {
    const NarxFamily& of = kNarxFamilies[i];
    options[i] = options_with(inner_family(of.inner).options);
    families.push_back({.name = of.name,
                        .summary = of.summary,
                        .model_family = of.model_family,
                        .options = options[i],
                        .fit = of.fit,
                        .only_if_named = true});
  }
  return families;
}

}  // namespace torsio
