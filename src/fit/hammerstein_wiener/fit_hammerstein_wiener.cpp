#include "fit/hammerstein_wiener/fit_hammerstein_wiener.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/checks.hpp"
#include "fit/common/excited_band.hpp"
#include "fit/common/fitted.hpp"
#include "fit/hammerstein_wiener/wiener_problem.hpp"
#include "fit/hammerstein_wiener/wiener_search.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kSamplesPerNumber = 10;

void check_options(const HammersteinWienerOptions& options) {
  const auto require_range = [](const std::optional<std::size_t>& value, const char* name,
                                std::size_t lowest, std::size_t highest) {
    if (value)
      require<UsageError>(*value >= lowest && *value <= highest, name,
                          fmt::format("{} to {}", lowest, highest), fmt::format("{}", *value));
  };
  constexpr std::size_t kMaxOrder = 2 * kMaxSections;
  require_range(options.zeros, "zeros", 0, kMaxOrder);
  require_range(options.poles, "poles", 0, kMaxOrder);
  require_range(options.input_degree, "input_degree", 1, StaticCurve::kMaxValues - 1);
  require_range(options.output_degree, "output_degree", 1, StaticCurve::kMaxValues - 1);
  require_range(options.knots, "knots", 3, StaticCurve::kMaxValues);
  require_range(options.iterations, "iterations", 1, 100'000);
}

void check_continuous(const HammersteinWienerOptions& options, const WienerShape& shape) {
  if (options.continuous == ContinuousForm::none || (shape.poles > 0 && shape.zeros <= shape.poles))
    return;
  throw UsageError({.place = "continuous",
                    .expected = "a pole or more, and no more zeros than poles",
                    .found = fmt::format("{} zeros, {} poles", shape.zeros, shape.poles)});
}

void check_data(const TrainingData& data, const WienerData& own) {
  if (own.scored_samples() == 0)
    throw Error({.place = "training records", .expected = "measured samples", .found = "none"});
  if (!(own.range.lowest < own.range.highest))
    throw Error({.place = data.inputs.front().expression,
                 .problem = "nothing moves the model",
                 .expected = "a first input that changes",
                 .found = fmt::format("{} in every training sample", own.range.lowest)});
  if (!(own.deviation > 0.0))
    throw Error({.place = data.target, .expected = "a target that changes", .found = "a constant"});
}

void check_length(const WienerData& own, const WienerShape& shape) {
  const std::size_t numbers = shape.zeros + shape.poles + shape.input_values + shape.output_values;
  if (own.scored_samples() < kSamplesPerNumber * numbers)
    throw Error({.place = "training records",
                 .expected = fmt::format("{} measured samples or more, ten for each of {} numbers",
                                         kSamplesPerNumber * numbers, numbers),
                 .found = fmt::format("{}", own.scored_samples()),
                 .advice = "Take lower orders and degrees, or give longer records."});
  const std::size_t lag = std::max(shape.zeros, shape.poles);
  const bool outlasts = std::ranges::any_of(
      own.records, [&](const WienerRecord& record) { return record.input.size() > lag + 1; });
  if (!outlasts)
    throw Error({.place = "training records",
                 .expected = fmt::format("a record longer than its lags of {} samples", lag),
                 .found = "none",
                 .advice = "Take fewer zeros and poles, or give longer records."});
}

/// The best fit of a shape, or the reason why there is none.
WienerFit fit_or_refuse(const WienerData& own, const WienerShape& shape, std::size_t iterations,
                        const Progress& progress) {
  auto fit = fit_shape(own, shape, {.iterations = iterations}, progress);
  if (!fit)
    throw Error(
        {.place = "hammerstein_wiener",
         .problem = "no linear model of this structure stays finite on the training records",
         .expected = "a stable start of the search",
         .found = fmt::format("none with {} zeros and {} poles", shape.zeros, shape.poles),
         .advice = "Use other orders; torsio check reports whether the records are usable."});
  if (!fit->has_converged)
    throw Error({.place = "hammerstein_wiener",
                 .problem = "the search did not converge",
                 .expected = fmt::format("an end within {} iterations", iterations),
                 .found = fmt::format(
                     "RMSE {:.4g} and still falling",
                     std::sqrt(fit->sum_of_squares / static_cast<double>(own.scored_samples()))),
                 .advice = "Raise iterations, or take lower orders and degrees."});
  return *std::move(fit);
}

std::string roots_text(const std::vector<std::complex<double>>& roots, double period_s,
                       bool with_time) {
  constexpr std::size_t kReadable = 8;
  std::vector<std::string> parts;
  for (const std::complex<double> root : roots) {
    if (root.imag() < 0.0) continue;
    if (parts.size() == kReadable) {
      parts.emplace_back("...");
      break;
    }
    const bool is_real = root.imag() == 0.0;
    std::string text = is_real ? fmt::format("{:.6g}", root.real())
                               : fmt::format("{:.6g} +- {:.4g}i", root.real(), root.imag());
    if (with_time && is_real && root.real() > 0.0)
      text += fmt::format(" ({:.4g} s)", -period_s / std::log(root.real()));
    parts.push_back(std::move(text));
  }
  return parts.empty() ? "none" : fmt::format("{}", fmt::join(parts, ", "));
}

class Summary {
 public:
  Summary(const TrainingData& data, const WienerData& own) : data_(data), own_(own) {}

  void linear_part(const HammersteinWiener::Parameters& p, std::vector<std::string>& notes) const {
    notes.push_back(fmt::format("poles {}; zeros {}",
                                roots_text(poles(p.sections), p.sample_period_s, true),
                                roots_text(zeros(p.sections), p.sample_period_s, false)));
    notes.push_back(fmt::format(
        "slope d({})/d({}) about rest: {:.4g} at once, {:.4g} after a long time", data_.target,
        data_.inputs.front().expression, slope_about_rest(p, first_gain(p.sections)),
        slope_about_rest(p, dc_gain(p.sections))));
    const ExcitedBand band = excited_band(data_);
    for (const std::complex<double> pole : poles(p.sections)) {
      if (pole.imag() != 0.0 || pole.real() <= 0.0) continue;
      const double rate_1_s = -std::log(pole.real()) / p.sample_period_s;
      if (const std::string place = outside_of(band, rate_1_s); place.starts_with("below"))
        notes.push_back(
            fmt::format("the pole {:.6g} ({:.2g} Hz) lies {}: its time constant may be far off; "
                        "add a slow record",
                        pole.real(), rate_1_s / (2.0 * std::numbers::pi), place));
    }
  }

  void what_is_held(const HammersteinWiener::Parameters& p, const WienerNumbers& numbers,
                    std::vector<std::string>& notes) const {
    const std::vector<double> x = WienerError(own_, numbers).inner(numbers);
    const auto out = std::ranges::count_if(
        x, [&](double value) { return value < p.lowest || value > p.highest; });
    if (out > 0)
      notes.push_back(fmt::format(
          "the output curve turns inside the training range and is held there: {:.2g} % of the "
          "samples lie beyond; a lower output_degree may do better",
          100.0 * static_cast<double>(out) / static_cast<double>(x.size())));
  }

  /// The coefficients with standard errors, and the directions that the data leave open.
  void table(const WienerNumbers& numbers, Fitted<HammersteinWiener>& fitted) const {
    const WienerError error(own_, numbers);
    const std::vector<double> packed = error.pack(numbers);
    std::vector<double> typical;
    for (std::size_t k = 0; k < packed.size(); ++k)
      typical.push_back(is_output(error, k) ? own_.deviation : std::max(std::abs(packed[k]), 1e-3));
    const ParameterUncertainty uncertainty =
        uncertainty_of(wiener_problem(error, packed.size(), natural_chart()), packed, typical);
    const std::string unit = unit_label(data_.target);
    for (std::size_t k = 0; k < error.model_size(); ++k)
      fitted.table.push_back({.name = error.names()[k],
                              .unit = is_output(error, k) ? unit : "",
                              .value = packed[k],
                              .std_error = uncertainty.std_error[k]});
    for (const std::vector<double>& direction : uncertainty.null_directions) {
      // The start states of the records are not part of the model.
      const auto own = std::span(direction).first(error.model_size());
      if (std::ranges::all_of(own, [](double part) { return std::abs(part) < 0.05; })) continue;
      fitted.notes.push_back(
          "the data do not determine " +
          description_of(own, std::span(error.names()).first(error.model_size())));
    }
  }

 private:
  static bool is_output(const WienerError& error, std::size_t k) {
    return k < error.model_size() && error.names()[k].front() == 'c';
  }
  static double first_gain(const Sections& sections) {
    double gain = 1.0;
    for (std::size_t i = 0; i < sections.rows; ++i) gain *= sections(i, 0);
    return gain;
  }
  double slope_about_rest(const HammersteinWiener::Parameters& p, double gain) const {
    return p.input.slope(own_.rest_input) * gain * p.output.slope(0.0);
  }

  const TrainingData& data_;
  const WienerData& own_;
};

double rmse_of(const WienerData& own, double sum_of_squares) {
  return std::sqrt(sum_of_squares / static_cast<double>(own.scored_samples()));
}

/// Structure and parameters.
WienerFit searched_fit(const WienerData& own, const HammersteinWienerOptions& options,
                       const Progress& progress, std::vector<std::string>& notes) {
  check_length(own, {.zeros = options.zeros.value_or(0),
                     .poles = options.poles.value_or(1),
                     .input_values = 2,
                     .output_values = 2});
  WienerChoice choice = chosen_shape(own, options, progress);
  notes.push_back(std::move(choice.note));
  check_length(own, choice.shape);
  check_continuous(options, choice.shape);
  return std::move(choice.fit);
}

WienerFit given_fit(const WienerData& own, const HammersteinWienerOptions& options,
                    const Progress& progress) {
  const WienerShape shape = given_shape(options);
  check_length(own, shape);
  check_continuous(options, shape);
  return fit_or_refuse(own, shape, options.iterations, progress);
}

ContinuousFit refine_or_refuse(const WienerData& own, const WienerNumbers& numbers,
                               std::size_t iterations, const Progress& progress) {
  ContinuousFit continuous = refined_in_continuous_time(own, numbers, iterations, progress);
  if (!continuous.fit.has_converged)
    throw Error({.place = "hammerstein_wiener: continuous",
                 .problem = "the search in continuous time did not converge",
                 .expected = fmt::format("an end within {} iterations", iterations),
                 .found = fmt::format("RMSE {:.4g}", rmse_of(own, continuous.fit.sum_of_squares)),
                 .advice = "Raise iterations, or take fewer poles."});
  return continuous;
}

}  // namespace

std::vector<std::string> continuous_notes(const HammersteinWiener::Parameters& parameters) {
  std::vector<std::string> notes;
  const DiscreteTransfer g = transfer_of(parameters.sections);
  constexpr std::size_t kReadable = 4;
  if (g.denominator.size() <= kReadable && g.denominator.size() > 1)
    notes.push_back(fmt::format("linear part in continuous time, by Tustin: X/W = {}",
                                text_of(tustin(g, parameters.sample_period_s))));
  if (std::string warning = continuous_warning(parameters.sections, parameters.sample_period_s);
      !warning.empty())
    notes.push_back(std::move(warning));
  return notes;
}

Fitted<HammersteinWiener> fit_hammerstein_wiener(const TrainingData& data,
                                                 const HammersteinWienerOptions& options,
                                                 const FitContext& context) {
  check_options(options);
  const WienerData own = wiener_data(data);
  check_data(data, own);
  Fitted<HammersteinWiener> fitted{.parameters = {}, .notes = {}};
  if (data.input_count() > 1)
    fitted.notes.push_back(fmt::format("of the {} inputs only the first, {}, is used",
                                       data.input_count(), data.inputs.front().expression));
  WienerFit fit = options.is_searched ? searched_fit(own, options, context.progress, fitted.notes)
                                      : given_fit(own, options, context.progress);
  const Summary summary(data, own);
  summary.table(fit.numbers, fitted);
  const double discrete_rmse = rmse_of(own, fit.sum_of_squares);
  std::ranges::move(continuous_notes(parameters_of(own, fit.numbers, 1)),
                    std::back_inserter(fitted.notes));
  if (options.continuous == ContinuousForm::tustin) {
    fit.numbers = held_between_samples(own, std::move(fit.numbers));
    fitted.notes.push_back(fmt::format(
        "its continuous form run by a first-order hold: training RMSE {:.4g}, discrete {:.4g}",
        rmse_of(own, WienerError(own, fit.numbers).sum_of_squares(fit.numbers)), discrete_rmse));
  } else if (options.continuous == ContinuousForm::refined) {
    ContinuousFit continuous =
        refine_or_refuse(own, fit.numbers, options.iterations, context.progress);
    std::vector<std::string> factors;
    factors.reserve(continuous.sections.size());
    for (const ContinuousTransfer& each : continuous.sections) factors.push_back(text_of(each));
    fitted.notes.push_back(fmt::format(
        "refined in continuous time, the curves as they were: X/W = {}; training RMSE {:.4g}, "
        "discrete {:.4g}",
        fmt::join(factors, " * "), rmse_of(own, continuous.fit.sum_of_squares), discrete_rmse));
    fit = std::move(continuous.fit);
  }
  fitted.parameters = parameters_of(own, fit.numbers, data.input_count());
  summary.linear_part(fitted.parameters, fitted.notes);
  summary.what_is_held(fitted.parameters, fit.numbers, fitted.notes);
  return fitted;
}

}  // namespace torsio
