#include "fit/narx/fit_narx_polynomial.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/regression.hpp"
#include "fit/common/usable_table.hpp"
#include "fit/gaussian_process/kernel_data.hpp"
#include "fit/narx/free_run_refinement.hpp"
#include "fit/narx/frols.hpp"
#include "fit/narx/narx_run.hpp"
#include "numerics/least_squares.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

using NarxPolynomial = Narx<MultivariatePolynomial>;

constexpr double kAsGood = 1.02;

/// The kind of a regressor.
struct Regressor {
  bool is_output = false;
  std::size_t input = 0;
  std::size_t lag = 0;
};

Regressor regressor(std::size_t index, std::size_t inputs, std::size_t input_lags) {
  const std::size_t outputs = inputs * (input_lags + 1);
  if (index >= outputs) return {.is_output = true, .lag = index - outputs + 1};
  return {.is_output = false, .input = index % inputs, .lag = index / inputs};
}

/// Names for an equation: an input that is an expression is u and its number.
std::vector<std::string> short_names(std::span<const std::string> inputs) {
  std::vector<std::string> names;
  for (const std::string& input : inputs) {
    const bool is_name = std::ranges::all_of(
        input, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
    names.push_back(is_name ? input : fmt::format("u{}", names.size() + 1));
  }
  return names;
}

/// "u_rad[k-1]"
std::string regressor_text(std::string_view name, std::size_t lag) {
  return fmt::format("{}[k{}]", name, lag == 0 ? "" : fmt::format("-{}", lag));
}

/// "u_rad[k]^2 torque_Nm[k-1]"; empty for a constant.
std::string term_text(std::span<const double> powers, std::size_t input_lags,
                      std::span<const std::string> names, std::string_view target) {
  std::vector<std::string> factors;
  for (std::size_t i = 0; i < powers.size(); ++i) {
    if (powers[i] == 0.0) continue;
    const Regressor of = regressor(i, names.size(), input_lags);
    factors.push_back(regressor_text(of.is_output ? target : names[of.input], of.lag));
    if (powers[i] > 1.0) factors.back() += fmt::format("^{:.0f}", powers[i]);
  }
  return fmt::format("{}", fmt::join(factors, " "));
}

Matrix powers_of(const std::vector<Monomial>& terms, std::size_t regressors) {
  Matrix powers(terms.size(), regressors);
  for (std::size_t j = 0; j < terms.size(); ++j)
    for (const std::size_t i : terms[j]) powers(j, i) += 1.0;
  return powers;
}

MultivariatePolynomial::Parameters polynomial_of(const NarxTerms& f) {
  return {.scales = f.scales,
          .powers = powers_of(f.terms, f.scales.size()),
          .coefficients = f.coefficients};
}

/// Records to choose terms on, and records to evaluate their number on.
struct Split {
  TrainingData training;
  TrainingData evaluation;
  std::string tested_on;
};

Sequence cut(const Sequence& from, std::size_t first, std::size_t end) {
  Sequence part{.recording = from.recording,
                .features = Matrix(end - first, from.features.columns),
                .target = {from.target.begin() + static_cast<std::ptrdiff_t>(first),
                           from.target.begin() + static_cast<std::ptrdiff_t>(end)},
                .use = {from.use.begin() + static_cast<std::ptrdiff_t>(first),
                        from.use.begin() + static_cast<std::ptrdiff_t>(end)}};
  for (std::size_t n = first; n < end; ++n)
    std::ranges::copy(from.features.row(n), part.features.row(n - first).begin());
  return part;
}

void hold_out(Split& split, std::size_t sequence, std::size_t first, std::size_t end) {
  Sequence& from = split.training.sequences[sequence];
  split.evaluation.sequences.push_back(cut(from, first, end));
  std::fill(from.use.begin() + static_cast<std::ptrdiff_t>(first),
            from.use.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{0});
}

/// Free run requires contiguous stretches, several times as long as their measured start.
Split split_of(const TrainingData& data, const FitContext& context) {
  constexpr std::size_t kFold = 5;
  constexpr std::size_t kMaxBlocks = 10;
  constexpr std::size_t kLeastBlock = 5 * kCorrected;
  if (context.validation != nullptr) return {data, *context.validation, "the validation records"};
  Split split{.training = data, .evaluation = data, .tested_on = "a fifth held out"};
  split.evaluation.sequences.clear();
  const bool has_many = data.sequences.size() >= kFold;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const std::size_t samples = data.sequences[s].target.size();
    const std::size_t blocks = has_many ? 1 : std::min(kMaxBlocks, samples / kLeastBlock);
    for (std::size_t block = 0; block < blocks; ++block)
      if ((has_many ? s : block) % kFold == kFold - 1)
        hold_out(split, s, samples * block / blocks, samples * (block + 1) / blocks);
  }
  if (split.evaluation.usable_samples() > 0 && split.training.usable_samples() > 0) return split;
  return {data, data, "the training records, too short to hold any out"};
}

double free_run_rmse(const NarxTerms& f, const Narx<Linear>::Parameters& frame,
                     const TrainingData& evaluation) {
  NarxPolynomial model(framed<MultivariatePolynomial>(polynomial_of(f), frame));
  const double rmse = free_run_rmse(simulated(model, evaluation), evaluation);
  return std::isfinite(rmse) ? rmse : std::numeric_limits<double>::infinity();
}

Matrix design_of(const NarxTerms& f, const Matrix& regressors) {
  Matrix design(regressors.rows, f.terms.size(), 1.0);
  for (std::size_t n = 0; n < regressors.rows; ++n)
    for (std::size_t j = 0; j < f.terms.size(); ++j)
      for (const std::size_t i : f.terms[j]) design(n, j) *= regressors(n, i) / f.scales[i];
  return design;
}

/// Terms chosen one step ahead, and their number by the error in free run.
struct Structure {
  NarxTerms f;
  std::vector<double> error_reductions;
  std::string note;
};

std::size_t max_terms(const NarxPolynomialOptions& options, std::size_t samples) {
  const std::size_t fits = samples / kSamplesPerTerm;
  if (options.terms == 0)
    return std::clamp<std::size_t>(fits, 1, NarxPolynomialOptions::kMaxAutomatic);
  if (options.terms <= fits) return options.terms;
  throw Error(
      {.problem = "too few training samples",
       .expected = fmt::format("at least {}, {} for each of {} terms",
                               kSamplesPerTerm * options.terms, kSamplesPerTerm, options.terms),
       .found = std::to_string(samples)});
}

TrainingData regressors_of(const TrainingData& data, const NarxPolynomialOptions& options,
                           double deviation, std::uint64_t seed) {
  if (options.training != NarxTraining::noise) return narx_data(data, options.lags);
  const OutputLists noisy = noisy_targets(data, options.noise * deviation, seed);
  return narx_data(data, options.lags, &noisy);
}

Structure chosen_structure(const Split& split, const Table& table,
                           const NarxPolynomialOptions& options,
                           const Narx<Linear>::Parameters& frame, const FitContext& context) {
  Frols found = frols(table.features, table.target,
                      {.degree = options.degree,
                       .terms = max_terms(options, table.target.size()),
                       .exchange = options.exchange},
                      share_of(context.progress, 0.0, 0.5));
  if (found.sizes.empty())
    throw Error({.place = split.training.target,
                 .expected = "a target that some term explains",
                 .found = "none does"});
  const auto terms_of = [&](const ChosenTerms& size) {
    return NarxTerms{
        .terms = size.terms, .scales = found.scales, .coefficients = size.coefficients};
  };
  std::size_t best = found.sizes.size() - 1;
  std::string why;
  if (options.terms == 0) {
    std::vector<double> rmse;
    for (const ChosenTerms& size : found.sizes)
      rmse.push_back(free_run_rmse(terms_of(size), frame, split.evaluation));
    const double enough = kAsGood * *std::ranges::min_element(rmse);
    best = static_cast<std::size_t>(
        std::ranges::find_if(rmse, [&](double each) { return each <= enough; }) - rmse.begin());
    why = fmt::format(", the number by the free run on {}", split.tested_on);
  } else if (found.sizes.size() < options.terms) {
    why = fmt::format(", {} asked for: no other explains anything more", options.terms);
  }
  const ChosenTerms& chosen = found.sizes[best];
  return {.f = terms_of(chosen),
          .error_reductions = chosen.error_reductions,
          .note = fmt::format("{} of {} terms{}", chosen.terms.size(), found.candidates, why)};
}

std::string error_reduction_note(const Structure& structure, const NarxPolynomialOptions& options,
                                 std::span<const std::string> names, const std::string& target) {
  const Matrix powers = powers_of(structure.f.terms, structure.f.scales.size());
  std::vector<std::string> parts;
  double sum = 0.0;
  for (std::size_t j = 0; j < powers.rows; ++j) {
    const std::string term = term_text(powers.row(j), options.lags.inputs, names, target);
    parts.push_back(fmt::format("{} {:.3g}", term.empty() ? "constant" : term,
                                100.0 * structure.error_reductions[j]));
    sum += structure.error_reductions[j];
  }
  return fmt::format("error reduction one step ahead in %: {}; left {:.3g}", fmt::join(parts, ", "),
                     100.0 * (1.0 - sum));
}

}  // namespace

std::string equation_of(const NarxPolynomial::Parameters& parameters,
                        std::span<const std::string> inputs, std::string_view target) {
  const MultivariatePolynomial::Parameters& f = parameters.model;
  const std::vector<std::string> names = short_names(inputs);
  std::string text = regressor_text(target, 0) + " =";
  for (std::size_t j = 0; j < f.powers.rows; ++j) {
    double coefficient = f.coefficients[j];
    for (std::size_t i = 0; i < f.scales.size(); ++i)
      coefficient /= std::pow(f.scales[i], f.powers(j, i));
    const std::string term = term_text(f.powers.row(j), parameters.input_lags, names, target);
    const bool is_negative = std::signbit(coefficient);
    text += fmt::format(" {}{:.4g}{}{}",
                        j == 0 ? (is_negative ? "-" : "") : (is_negative ? "- " : "+ "),
                        std::abs(coefficient), term.empty() ? "" : " ", term);
  }
  for (std::size_t i = 0; i < inputs.size(); ++i)
    if (names[i] != inputs[i]) text += fmt::format(", {} = {}", names[i], inputs[i]);
  return text;
}

Fitted<NarxPolynomial> fit_narx_polynomial(const TrainingData& data,
                                           const NarxPolynomialOptions& options,
                                           const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting narx_polynomial");
  check_lags(options.lags);
  require_free_run(context.validation == nullptr ? data : *context.validation);
  const TargetSpread spread = spread_of(data);
  const Narx<Linear>::Parameters frame = narx_frame(data, options.lags, options.range, spread);
  check_candidates(frame.regressors(), options.degree);
  const Split split = options.terms == 0 ? split_of(data, context) : Split{data, data, {}};
  Structure structure = chosen_structure(
      split, usable_table(regressors_of(split.training, options, spread.deviation, context.seed)),
      options, frame, context);

  report_progress(context.progress, 0.5, "fitting the chosen terms");
  const TrainingData regressors = regressors_of(data, options, spread.deviation, context.seed);
  const Table table = usable_table(regressors);
  NarxTerms f = structure.f;
  f.coefficients = least_squares(design_of(f, table.features), table.target).coefficients;
  std::vector<std::string> notes = constant_inputs(data, usable_table(data).features);
  notes.push_back(structure.note);
  if (options.training == NarxTraining::free_run) {
    report_progress(context.progress, 0.6, "refining narx_polynomial");
    const TrainingData& evaluation = context.validation == nullptr ? data : *context.validation;
    Refined refined = refined_in_free_run(f, data, regressors, options.lags,
                                          share_of(context.progress, 0.6, 1.0));
    NarxTerms better = f;
    better.coefficients = std::move(refined.coefficients);
    const double before = free_run_rmse(f, frame, evaluation);
    const double after = free_run_rmse(better, frame, evaluation);
    notes.push_back(refinement_note(before, after, refined.report, context.validation != nullptr));
    if (after < before) f = std::move(better);
  }
  NarxPolynomial::Parameters parameters = framed<MultivariatePolynomial>(polynomial_of(f), frame);
  std::vector<std::string> inputs;
  for (const InputInfo& input : data.inputs) inputs.push_back(input.expression);
  notes.push_back(equation_of(parameters, inputs, data.target));
  notes.push_back(error_reduction_note(structure, options, short_names(inputs), data.target));
  return {std::move(parameters), std::move(notes)};
}

}  // namespace torsio
