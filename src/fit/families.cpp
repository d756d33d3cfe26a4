#include "torsio/fit/families.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "data/names.hpp"
#include "fit/common/fitted_model.hpp"
#include "fit/gaussian_process/gaussian_process_families.hpp"
#include "fit/grey_box/fit_grey_box.hpp"
#include "fit/hammerstein_wiener/hammerstein_wiener_families.hpp"
#include "fit/hysteresis/hysteresis_families.hpp"
#include "fit/linear/fit_linear.hpp"
#include "fit/linear/fit_polynomial.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/narx/narx_families.hpp"
#include "fit/network/network_families.hpp"
#include "fit/second_order/second_order_families.hpp"
#include "fit/viscoelastic/fit_viscoelastic.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr OptionInfo kRates{
    "rates", Kind::boolean, "false", 0, 0, "give inputs that are rates a slope too"};
constexpr OptionInfo kSchedule{
    "schedule", Kind::text,
    "",         0,
    0,          "input over whose distinct training values all coefficients are interpolated"};

constexpr std::array kLinearOptions{kRates, kSchedule};

constexpr std::array kLinearCoulombOptions{
    OptionInfo{"rate_scale", Kind::number, "auto", 1e-12, 1e12,
               "rate at which friction reaches 76 % of its full value; auto: searched for"},
    kRates, kSchedule};

constexpr std::array kPolynomialOptions{
    OptionInfo{"degree", Kind::integer, "5", 0, Polynomial::kHighestDegree,
               "of the curve; 0: chosen by cross-validation"},
    OptionInfo{"branch", Kind::boolean, "true", 0, 0,
               "one curve for each direction of the first input"},
    OptionInfo{"dead_band", Kind::number, "auto", 0, 1e12,
               "how far the first input moves back before its direction turns"},
    kRates, kSchedule};

constexpr std::array kDgmmOptions{
    OptionInfo{"components", Kind::integer, "300", 1, 100000, "at most this many Gaussians"},
    OptionInfo{"novelty_distance", Kind::number, "auto", 0, 100,
               "in standard deviations: a sample farther from all Gaussians becomes a new one; "
               "auto: 5/3 of the initial spread"},
    OptionInfo{"initial_spread", Kind::number, "auto", 1e-6, 100,
               "standard deviation of a Gaussian that has seen one sample, in standard deviations; "
               "auto: found by leaving one training record out at a time"},
    OptionInfo{"learning_rate_floor", Kind::number, "0", 0, 1,
               "0: means settle; above: they keep following"},
    OptionInfo{"forgetting", Kind::number, "1", 0, 1, "of a Gaussian's past with each sample"},
    OptionInfo{"prune_count", Kind::number, "0", 0, 1e12, "drop Gaussians of fewer samples ..."},
    OptionInfo{"prune_age", Kind::integer, "0", 0, 1e12, "... once so many samples old; 0: never"},
    OptionInfo{"em_iterations", Kind::integer, "10", 0, 10000,
               "of expectation maximisation after the online pass; 0: none"},
    OptionInfo{"clamp", Kind::number, "2", 0, 1e6,
               "where data are thin, stay this many RMSE from the straight line; 0: off"},
    OptionInfo{"background_weight", Kind::number, "0.001", 0, 0.999,
               "of one Gaussian over all data; 0: none"}};

constexpr std::array kDgmmPaperOptions{
    OptionInfo{"components", Kind::integer, "500", 1, 100000, "Gaussians"},
    OptionInfo{"learning_rate", Kind::number, "0.02", 0, 1, "of the nearest Gaussian's mean"},
    OptionInfo{"spread", Kind::number, "0.15", 1e-6, 100,
               "of every Gaussian in every direction, in standard deviations"}};

constexpr std::array kViscoelasticOptions{
    OptionInfo{
        "network", Kind::text, "generalised_maxwell(2)", 0, 0,
        "springs and dashpots, like series(kv(k1, d1), k2), or a name: hooke, maxwell, "
        "kelvin_voigt, standard_linear_solid, burgers, generalised_maxwell(n), 003a to 003d"},
    OptionInfo{"refine", Kind::boolean, "true", 0, 0,
               "false: the given values (k1=300) as they are, the offset alone is fitted"},
    OptionInfo{"at_rest", Kind::boolean, "true", 0, 0,
               "each record starts relaxed; false: from a state that is fitted too"},
    OptionInfo{"starts", Kind::integer, "10", 1, 1000, "of the search"},
    OptionInfo{
        "prior", Kind::number, "0", 0, 1000,
        "draws the logarithm of each parameter towards its start value, within this; 0: off"}};

FittedModel linear(const TrainingData& data, const Options& options, const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting linear");
  return fitted_model(
      fit_linear(data, {.rates = options.boolean("rates"), .schedule = options.text("schedule")}));
}

FittedModel linear_coulomb(const TrainingData& data, const Options& options,
                           const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting linear_coulomb");
  return fitted_model(fit_linear_coulomb(data, {.rates = options.boolean("rates"),
                                                .schedule = options.text("schedule"),
                                                .rate_scale = options.number("rate_scale")}));
}

FittedModel polynomial(const TrainingData& data, const Options& options,
                       const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting polynomial");
  return fitted_model(fit_polynomial(data, {.degree = options.integer("degree"),
                                            .branch = options.boolean("branch"),
                                            .dead_band = options.number("dead_band"),
                                            .rates = options.boolean("rates"),
                                            .schedule = options.text("schedule")}));
}

FittedModel dgmm(const TrainingData& data, const Options& options, const FitContext& context) {
  return fitted_model(
      fit_dgmm(data,
               {.online = {.components = options.integer("components"),
                           .novelty_distance = options.number("novelty_distance"),
                           .initial_spread = options.number("initial_spread"),
                           .learning_rate_floor = options.number("learning_rate_floor"),
                           .forgetting = options.number("forgetting"),
                           .prune_count = options.number("prune_count"),
                           .prune_age = options.integer("prune_age")},
                .em_iterations = options.integer("em_iterations"),
                .clamp = options.number("clamp"),
                .background_weight = options.number("background_weight")},
               context.progress));
}

constexpr std::array kGreyBoxOptions{
    kSchedule,
    OptionInfo{"passive", Kind::boolean, "false", 0, 0,
               "only friction and relaxation that take energy, as true ones do; no residual"},
    OptionInfo{"residual", Kind::text, "auto", 0, 0,
               "learned on what the terms leave over: none, mlp, dgmm; auto: mlp if it lowers the "
               "error on data that it did not see"},
    OptionInfo{"bound", Kind::number, "3", 0, 1e6,
               "of the residual, in root mean squares of what is left over"}};

ResidualKind residual_of(const Options& options) {
  const std::string& text = options.text("residual");
  if (text == "none") return ResidualKind::none;
  if (text == "mlp") return ResidualKind::mlp;
  if (text == "dgmm") return ResidualKind::dgmm;
  if (text == "auto") return ResidualKind::automatic;
  throw UsageError({.place = "option residual",
                    .expected = "one of auto, none, mlp, dgmm",
                    .found = '"' + text + '"'});
}

FittedModel grey_box(const TrainingData& data, const Options& options, const FitContext& context) {
  FittedGreyBox fitted = fit_grey_box(data,
                                      {.schedule = options.text("schedule"),
                                       .passive = options.boolean("passive"),
                                       .bound = options.number("bound"),
                                       .residual = residual_of(options)},
                                      context);
  const double held_out_rmse = fitted.held_out_rmse;
  FittedModel model = fitted_model<GreyBox>(std::move(fitted));
  model.held_out_rmse = held_out_rmse;
  return model;
}

FittedModel dgmm_paper(const TrainingData& data, const Options& options,
                       const FitContext& context) {
  return fitted_model(fit_dgmm_paper(data,
                                     {.components = options.integer("components"),
                                      .learning_rate = options.number("learning_rate"),
                                      .spread = options.number("spread")},
                                     context.progress));
}

FittedModel viscoelastic(const TrainingData& data, const Options& options,
                         const FitContext& context) {
  return fitted_model(fit_viscoelastic(data,
                                       {.network = options.text("network"),
                                        .starts = options.integer("starts"),
                                        .prior = options.number("prior"),
                                        .is_refined = options.boolean("refine"),
                                        .is_at_rest = options.boolean("at_rest")},
                                       context));
}

constexpr std::array kShallowFamilies{
    FamilyInfo{Linear::kFamily, "spring with a bias: b + sum k x", kLinearOptions, linear},
    FamilyInfo{LinearCoulomb::kFamily, "spring with a bias and friction: b + sum k x + c tanh(r/v)",
               kLinearCoulombOptions, linear_coulomb},
    FamilyInfo{Polynomial::kFamily,
               "curve of the first input, one for each direction: P(x) + sum k x",
               kPolynomialOptions, polynomial},
    FamilyInfo{GreyBox::kFamily,
               "torsio's own: elastic curve, slip, relaxation and friction, as the data ask for",
               kGreyBoxOptions, grey_box},
    FamilyInfo{.name = Viscoelastic::kFamily,
               .summary = "network of springs and dashpots that the first input deflects",
               .options = kViscoelasticOptions,
               .fit = viscoelastic,
               .only_if_named = true},
};

constexpr std::array kMixtureFamilies{
    FamilyInfo{Dgmm::kFamily, "Gaussian mixture of target and inputs, learned sample by sample",
               kDgmmOptions, dgmm},
    FamilyInfo{"dgmm_paper",
               "Algorithm 1 of paper 000, the sign of its update corrected: for comparison only",
               kDgmmPaperOptions, dgmm_paper},
};

}  // namespace

std::span<const FamilyInfo> families() noexcept {
  static const std::vector<FamilyInfo> all = [] {
    std::vector<FamilyInfo> list(kShallowFamilies.begin(), kShallowFamilies.end());
    for (const auto more :
         {hysteresis_families(), std::span<const FamilyInfo>(kMixtureFamilies),
          gaussian_process_families(), network_families(), second_order_families()})
      list.insert(list.end(), more.begin(), more.end());
    const auto hammerstein_wiener = hammerstein_wiener_families();
    list.insert(list.end(), hammerstein_wiener.begin(), hammerstein_wiener.end());
    const auto with_feedback = narx_families(list);
    list.insert(list.end(), with_feedback.begin(), with_feedback.end());
    return list;
  }();
  return all;
}

bool has_option(const FamilyInfo& family, std::string_view option) noexcept {
  return std::ranges::find(family.options, option, &OptionInfo::name) != family.options.end();
}

const FamilyInfo& find_family(std::string_view name) {
  const auto all = families();
  const auto family = std::ranges::find(all, name, &FamilyInfo::name);
  if (family != all.end()) return *family;
  std::vector<std::string> names;
  names.reserve(all.size());
  for (const FamilyInfo& each : all) names.emplace_back(each.name);
  throw UsageError({.problem = "no model family is called \"" + std::string(name) + '"',
                    .expected = "one of " + joined(names),
                    .advice = did_you_mean(name, names)});
}

}  // namespace torsio
