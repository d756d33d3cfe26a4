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
#include "fit/narx/frols.hpp"
#include "fit/narx/narx_run.hpp"
#include "model/gaussian_process/gaussian_process.hpp"
#include "model/gaussian_process/parametric_gp.hpp"
#include "model/mixture/dgmm.hpp"
#include "torsio/core/error.hpp"
#include "torsio/fit/families.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr OptionInfo kInputLags{
    "input_lags", Kind::integer, "2", 0, 1000, "past samples of each input that the model sees"};
constexpr OptionInfo kOutputLags{
    "output_lags", Kind::integer, "2", 1, 1000, "past outputs of its own that it sees"};
constexpr OptionInfo kRange{"output_range",
                            Kind::number,
                            "1.2",
                            1,
                            1e6,
                            "times the largest training |target|: where the output is clipped"};

constexpr std::array kArxOptions{kInputLags, kOutputLags,
                                 OptionInfo{"refine", Kind::boolean, "true", 0, 0,
                                            "from one step ahead to least error in free run"},
                                 kRange};

constexpr OptionInfo kFeedbackNoise{
    "feedback_noise",
    Kind::number,
    "0.02",
    0,
    10,
    "of training=noise, as a share of the target's standard deviation"};

constexpr std::array kNarxPolynomialOptions{
    kInputLags,
    kOutputLags,
    OptionInfo{"degree", Kind::integer, "3", 1, MultivariatePolynomial::kHighestDegree,
               "of the terms to choose from"},
    OptionInfo{"terms", Kind::integer, "0", 0, kMostTerms,
               "to choose; 0: as many as free run on held-out records wants, up to 20"},
    OptionInfo{"exchange", Kind::boolean, "true", 0, 0,
               "swap chosen terms for others wherever that explains more"},
    OptionInfo{"training", Kind::text, "free_run", 0, 0,
               "of the coefficients: one_step (on measured past outputs), noise (on these with "
               "noise), free_run (then refined to least error in free run)"},
    kFeedbackNoise,
    kRange};

constexpr std::array kNarxOptions{
    kInputLags,
    kOutputLags,
    OptionInfo{"training", Kind::text, "free_run", 0, 0,
               "what past outputs are while it learns: one_step (measured), noise (measured, with "
               "noise), free_run (its own, in rounds)"},
    kFeedbackNoise,
    OptionInfo{"rounds", Kind::integer, "5", 1, 1000, "of training=free_run"},
    kRange};

NarxLags lags_of(const Options& options) {
  return {.inputs = options.integer("input_lags"), .outputs = options.integer("output_lags")};
}

NarxTraining training_of(const Options& options) {
  const std::string& text = options.text("training");
  if (text == "one_step") return NarxTraining::one_step;
  if (text == "noise") return NarxTraining::noise;
  if (text == "free_run") return NarxTraining::free_run;
  throw UsageError({.place = "option training",
                    .expected = "one of one_step, noise, free_run",
                    .found = '"' + text + '"'});
}

FittedModel arx(const TrainingData& data, const Options& options, const FitContext& context) {
  return fitted_model(fit_arx(data,
                              {.lags = lags_of(options),
                               .is_refined = options.boolean("refine"),
                               .range = options.number("output_range")},
                              context));
}

FittedModel narx_polynomial(const TrainingData& data, const Options& options,
                            const FitContext& context) {
  return fitted_model(fit_narx_polynomial(data,
                                          {.lags = lags_of(options),
                                           .degree = options.integer("degree"),
                                           .terms = options.integer("terms"),
                                           .exchange = options.boolean("exchange"),
                                           .training = training_of(options),
                                           .noise = options.number("feedback_noise"),
                                           .range = options.number("output_range")},
                                          context));
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
  const FamilyInfo& inner = find_family(family);
  return fit_narx(data,
                  {.lags = lags_of(options),
                   .training = training_of(options),
                   .noise = options.number("feedback_noise"),
                   .rounds = options.integer("rounds"),
                   .range = options.number("output_range")},
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

struct NarxFamily {
  std::string_view name;
  std::string_view inner;
  std::string_view summary;
  FittedModel (*fit)(const TrainingData&, const Options&, const FitContext&);
};

template <class M>
constexpr NarxFamily narx_family(std::string_view summary) {
  return {Narx<M>::kFamily, M::kFamily, summary, narx<M>};
}

constexpr std::array kNarxFamilies{
    narx_family<Dgmm>("Gaussian mixture that hears its own past output"),
    narx_family<Mlp>("neural network that hears its own past output"),
    narx_family<GaussianProcess>("exact Gaussian process that hears its own past output"),
    narx_family<ParametricGp>(
        "Gaussian process at a few hypothetical inputs that hears its own past output"),
    NarxFamily{"narx_parametric_gp_variational", kVariational,
               "the same by a variational bound, in closed form", narx_variational}};

std::vector<OptionInfo> options_with(std::span<const OptionInfo> inner) {
  std::vector<OptionInfo> all(kNarxOptions.begin(), kNarxOptions.end());
  all.insert(all.end(), inner.begin(), inner.end());
  return all;
}

}  // namespace

std::vector<FamilyInfo> narx_families(std::span<const FamilyInfo> known) {
  static std::array<std::vector<OptionInfo>, kNarxFamilies.size()> options;
  std::vector<FamilyInfo> families{
      {.name = "arx",
       .summary = "line over inputs and its own past output, least error in free run",
       .options = kArxOptions,
       .fit = arx,
       .only_if_named = true},
      {.name = Narx<MultivariatePolynomial>::kFamily,
       .summary = "few products of inputs and its own past output, chosen one by one",
       .options = kNarxPolynomialOptions,
       .fit = narx_polynomial,
       .only_if_named = true}};
  for (std::size_t i = 0; i < kNarxFamilies.size(); ++i) {
    const NarxFamily& of = kNarxFamilies[i];
    options[i] = options_with(std::ranges::find(known, of.inner, &FamilyInfo::name)->options);
    families.push_back({.name = of.name,
                        .summary = of.summary,
                        .options = options[i],
                        .fit = of.fit,
                        .only_if_named = true});
  }
  return families;
}

}  // namespace torsio
