#include "fit/hammerstein_wiener/hammerstein_wiener_families.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "fit/common/fitted_model.hpp"
#include "fit/hammerstein_wiener/fit_hammerstein_wiener.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using Kind = OptionInfo::Kind;

constexpr std::array kOptions{
    OptionInfo{
        "structure", Kind::text, "search", 0, 0,
        "search: what stands at auto is chosen by the error on held-out blocks; given: auto is "
        "1 zero, 2 poles (in 1/z), degrees 2 and 3, as (2) to (6) of paper 003"},
    OptionInfo{"zeros", Kind::integer, "auto", 0, 100, "of the linear part"},
    OptionInfo{"poles", Kind::integer, "auto", 0, 100, "of the linear part"},
    OptionInfo{"map", Kind::text, "polynomial", 0, 0,
               "curves before and behind the linear part: polynomial or piecewise_linear"},
    OptionInfo{"input_degree", Kind::integer, "auto", 1, 20, "of the curve before it"},
    OptionInfo{"output_degree", Kind::integer, "auto", 1, 20, "of the curve behind it"},
    OptionInfo{"knots", Kind::integer, "5", 3, 100, "of each curve, of map=piecewise_linear"},
    OptionInfo{"continuous", Kind::text, "none", 0, 0,
               "tustin: the linear part as Tustin's continuous form runs between samples; refined: "
               "refined in continuous time, the curves as found"},
    OptionInfo{"iterations", Kind::integer, "200", 1, 100000, "of one search, at most"},
    OptionInfo{
        "published", Kind::text, "none", 0, 0,
        "what paper 003 prints of its coupling in place of a fit: discrete, tustin or refined; "
        "first input in rad, target in Nm, 200 Hz"}};

[[noreturn]] void refuse(std::string_view option, std::string_view expected,
                         const std::string& found) {
  throw UsageError({.place = fmt::format("option {}", option),
                    .expected = std::string(expected),
                    .found = '"' + found + '"'});
}

bool is_second(const Options& options, std::string_view option, std::string_view first,
               std::string_view second) {
  const std::string& text = options.text(option);
  if (text != first && text != second) refuse(option, fmt::format("{} or {}", first, second), text);
  return text == second;
}

std::optional<Paper003> published_form(const Options& options) {
  const std::string& text = options.text("published");
  if (text == "none") return std::nullopt;
  if (text == "discrete") return Paper003::discrete;
  if (text == "tustin") return Paper003::tustin;
  if (text == "refined") return Paper003::refined;
  refuse("published", "none, discrete, tustin or refined", text);
}

ContinuousForm continuous_form(const Options& options) {
  const std::string& text = options.text("continuous");
  if (text == "none") return ContinuousForm::none;
  if (text == "tustin") return ContinuousForm::tustin;
  if (text == "refined") return ContinuousForm::refined;
  refuse("continuous", "none, tustin or refined", text);
}

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

std::optional<std::size_t> order(const Options& options, std::string_view name) {
  const double value = options.number(name);
  return std::isfinite(value) ? std::optional(static_cast<std::size_t>(value)) : std::nullopt;
}

FittedModel hammerstein_wiener(const TrainingData& data, const Options& options,
                               const FitContext& context) {
  if (const auto form = published_form(options)) return published(data, *form);
  return fitted_model(fit_hammerstein_wiener(
      data,
      {.zeros = order(options, "zeros"),
       .poles = order(options, "poles"),
       .input_degree = order(options, "input_degree"),
       .output_degree = order(options, "output_degree"),
       .is_piecewise_linear = is_second(options, "map", "polynomial", "piecewise_linear"),
       .knots = options.integer("knots"),
       .is_searched = !is_second(options, "structure", "search", "given"),
       .continuous = continuous_form(options),
       .iterations = options.integer("iterations")},
      context));
}

constexpr std::array kFamilies{
    FamilyInfo{.name = HammersteinWiener::kFamily,
               .summary = "linear system between two curves, least error in free run",
               .options = kOptions,
               .fit = hammerstein_wiener,
               .only_if_named = true}};

}  // namespace

std::span<const FamilyInfo> hammerstein_wiener_families() noexcept { return kFamilies; }

}  // namespace torsio
