#include "torsio/train/families.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/train/fit_linear.hpp"
#include "torsio/train/fit_polynomial.hpp"

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

template <class Family>
FittedModel fitted_model(Fitted<Family> fitted) {
  return {Family(fitted.parameters), std::move(fitted.notes)};
}

FittedModel linear(const TrainingData& data, const Options& options, std::uint64_t /*seed*/,
                   const Progress& progress) {
  report_progress(progress, 0.0, "fitting linear");
  return fitted_model(
      fit_linear(data, {.rates = options.boolean("rates"), .schedule = options.text("schedule")}));
}

FittedModel linear_coulomb(const TrainingData& data, const Options& options, std::uint64_t /*seed*/,
                           const Progress& progress) {
  report_progress(progress, 0.0, "fitting linear_coulomb");
  return fitted_model(fit_linear_coulomb(data, {.rates = options.boolean("rates"),
                                                .schedule = options.text("schedule"),
                                                .rate_scale = options.number("rate_scale")}));
}

FittedModel polynomial(const TrainingData& data, const Options& options, std::uint64_t /*seed*/,
                       const Progress& progress) {
  report_progress(progress, 0.0, "fitting polynomial");
  return fitted_model(fit_polynomial(data, {.degree = options.integer("degree"),
                                            .branch = options.boolean("branch"),
                                            .dead_band = options.number("dead_band"),
                                            .rates = options.boolean("rates"),
                                            .schedule = options.text("schedule")}));
}

constexpr std::array kFamilies{
    FamilyInfo{Linear::kFamily, "spring with a bias: b + sum k x", kLinearOptions, linear},
    FamilyInfo{LinearCoulomb::kFamily, "spring with a bias and friction: b + sum k x + c tanh(r/v)",
               kLinearCoulombOptions, linear_coulomb},
    FamilyInfo{Polynomial::kFamily,
               "curve of the first input, one for each direction: P(x) + sum k x",
               kPolynomialOptions, polynomial},
};

}  // namespace

std::span<const FamilyInfo> families() noexcept { return kFamilies; }

const FamilyInfo& find_family(std::string_view name) {
  const auto* const family = std::ranges::find(kFamilies, name, &FamilyInfo::name);
  if (family != kFamilies.end()) return *family;
  std::vector<std::string> names;
  names.reserve(kFamilies.size());
  for (const FamilyInfo& each : kFamilies) names.emplace_back(each.name);
  throw UsageError({.problem = "no model family is called \"" + std::string(name) + '"',
                    .expected = "one of " + joined(names),
                    .advice = did_you_mean(name, names)});
}

}  // namespace torsio
