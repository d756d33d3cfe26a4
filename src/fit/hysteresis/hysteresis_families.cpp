#include "fit/hysteresis/hysteresis_families.hpp"

#include <array>

#include "fit/common/fitted_model.hpp"
#include "fit/hysteresis/fit_hysteresis.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr OptionInfo kThresholds{
    "thresholds", Kind::integer, "8", 1, kMostThresholds, "of the operators, by the input's range"};
constexpr OptionInfo kRates{
    "rates", Kind::boolean, "false", 0, 0, "give inputs that are rates a slope too"};
constexpr OptionInfo kSchedule{
    "schedule", Kind::text,
    "",         0,
    0,          "input over whose distinct training values all weights are interpolated"};
constexpr OptionInfo kIterations{
    "iterations", Kind::integer, "200", 1, 100000, "of the search from each start, at most"};

constexpr std::array kMaxwellSlipOptions{kThresholds, kRates, kSchedule};
constexpr std::array kPrandtlIshlinskiiOptions{
    kThresholds,
    OptionInfo{"passive", Kind::boolean, "true", 0, 0,
               "keep weights to the sign with which no closed path gives work"},
    kRates, kSchedule};
constexpr std::array kImprovedPrandtlIshlinskiiOptions{
    kThresholds,
    OptionInfo{"bends", Kind::integer, "4", 0, 32, "of the curve behind, half on either side of 0"},
    kRates, kIterations};
constexpr std::array kBoucWenOptions{kRates, kIterations};
constexpr std::array kBacklashOptions{
    OptionInfo{"degree", Kind::integer, "5", 0, kHighestCurveDegree, "of the boundaries"}, kRates,
    kIterations};
constexpr std::array kExponentialLoadingOptions{
    OptionInfo{"degree", Kind::integer, "1", 0, kHighestCurveDegree, "of the curves it nears"},
    kRates, kIterations};

OperatorSumOptions sum_options(const Options& options, bool passive) {
  return {.thresholds = options.integer("thresholds"),
          .passive = passive,
          .rates = options.boolean("rates"),
          .schedule = options.text("schedule")};
}

HysteresisSearchOptions search_options(const Options& options) {
  return {.most_iterations = options.integer("iterations"), .rates = options.boolean("rates")};
}

FittedModel maxwell_slip(const TrainingData& data, const Options& options,
                         const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting maxwell_slip");
  return fitted_model(fit_maxwell_slip(data, sum_options(options, true)));
}

FittedModel prandtl_ishlinskii(const TrainingData& data, const Options& options,
                               const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting prandtl_ishlinskii");
  return fitted_model(
      fit_prandtl_ishlinskii(data, sum_options(options, options.boolean("passive"))));
}

FittedModel improved_prandtl_ishlinskii(const TrainingData& data, const Options& options,
                                        const FitContext& context) {
  HysteresisSearchOptions search = search_options(options);
  search.thresholds = options.integer("thresholds");
  search.bends = options.integer("bends");
  return fitted_model(fit_improved_prandtl_ishlinskii(data, search, context.progress));
}

FittedModel bouc_wen(const TrainingData& data, const Options& options, const FitContext& context) {
  return fitted_model(fit_bouc_wen(data, search_options(options), context.progress));
}

FittedModel nonlinear_backlash(const TrainingData& data, const Options& options,
                               const FitContext& context) {
  HysteresisSearchOptions search = search_options(options);
  search.degree = options.integer("degree");
  return fitted_model(fit_nonlinear_backlash(data, search, context.progress));
}

FittedModel improved_nonlinear_backlash(const TrainingData& data, const Options& options,
                                        const FitContext& context) {
  HysteresisSearchOptions search = search_options(options);
  search.degree = options.integer("degree");
  return fitted_model(fit_improved_nonlinear_backlash(data, search, context.progress));
}

FittedModel exponential_loading(const TrainingData& data, const Options& options,
                                const FitContext& context) {
  HysteresisSearchOptions search = search_options(options);
  search.degree = options.integer("degree");
  return fitted_model(fit_exponential_loading(data, search, context.progress));
}

constexpr std::array kFamilies{
    FamilyInfo{.name = MaxwellSlipModel::kFamily,
               .summary = "line and springs that slip: b + sum k x + sum clip(F + c dx)",
               .options = kMaxwellSlipOptions,
               .fit = maxwell_slip},
    FamilyInfo{.name = PrandtlIshlinskii::kFamily,
               .summary = "line and play operators: b + sum k x + sum w P[x]",
               .options = kPrandtlIshlinskiiOptions,
               .fit = prandtl_ishlinskii},
    FamilyInfo{.name = ImprovedPrandtlIshlinskii::kFamily,
               .summary = "the same behind a bent curve, thresholds growing with the rate",
               .options = kImprovedPrandtlIshlinskiiOptions,
               .fit = improved_prandtl_ishlinskii,
               .only_if_named = true},
    FamilyInfo{.name = BoucWenModel::kFamily,
               .summary = "spring and a smooth hysteresis: b + alpha k x + (1 - alpha) k z",
               .options = kBoucWenOptions,
               .fit = bouc_wen,
               .only_if_named = true},
    FamilyInfo{.name = NonlinearBacklash::kFamily,
               .summary = "a spring between two curves: clip(y + k dx, f_dc(x), f_ac(x))",
               .options = kBacklashOptions,
               .fit = nonlinear_backlash,
               .only_if_named = true},
    FamilyInfo{.name = ImprovedNonlinearBacklash::kFamily,
               .summary = "the same, the curves growing with the rate",
               .options = kBacklashOptions,
               .fit = improved_nonlinear_backlash,
               .only_if_named = true},
    FamilyInfo{.name = ExponentialLoading::kFamily,
               .summary = "nears one of two curves exponentially from the last reversal on",
               .options = kExponentialLoadingOptions,
               .fit = exponential_loading,
               .only_if_named = true}};

}  // namespace

std::span<const FamilyInfo> hysteresis_families() noexcept { return kFamilies; }

}  // namespace torsio
