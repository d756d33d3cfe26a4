#include "fit/grey_box/fit_grey_box.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/held_out.hpp"
#include "fit/grey_box/box_average.hpp"
#include "fit/grey_box/empty_terms.hpp"
#include "fit/grey_box/grey_box_search.hpp"
#include "fit/grey_box/late_target.hpp"
#include "fit/grey_box/residual_choice.hpp"
#include "fit/grey_box/stroke_errors.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Share of a rate's root mean square over which dry friction changes its sign: the whole of it, or
/// nearly a step.
constexpr std::array kRateShares{0.2, 0.02};
constexpr double kClearly = 0.99;  // less of the held-out error

void learn_residual(FittedGreyBox& fitted, const TrainingData& data, const GreyBoxOptions& options,
                    const FitContext& context) {
  ChosenResidual chosen = chosen_residual(data, fitted.parameters, options, context);
  fitted.parameters.residual = std::move(chosen.residual);
  fitted.held_out_rmse *= chosen.rmse_share;
  if (!chosen.note.empty()) fitted.notes.push_back(std::move(chosen.note));
}

/// A box, the search that chose its terms of the first input, and the error where a contiguous fifth of a single
/// recording is held out; 0: none was.
struct ChosenBox {
  GreyBoxSearch search;
  GreyBoxSearch::Candidate chosen;  ///< without banks
  double rate_share = 0.0;
  FittedGreyBox fitted = {};
  GreyBoxChoice choice = {};  ///< with banks
  double spans_rmse = 0.0;
};

/// Takes the terms of a search, with a note.
/// @param without error without banks
void keep(ChosenBox& box, const GreyBoxSearch& search, const GreyBoxSearch::Candidate& chosen,
          const TrainingData& data, double without) {
  FittedGreyBox& fitted = box.fitted;
  box.choice = chosen.choice;
  fitted.parameters = search.fitted(chosen.choice);
  fitted.held_out_rmse = chosen.held_out_error;
  fitted.notes.push_back(
      fmt::format("with banks over other inputs: {}; held out ({}): RMSE {:.4g}, {:.4g} without",
                  search.description_of(chosen.choice, data), search.what_was_held_out(),
                  chosen.held_out_error, without));
}

/// "the torque is late", and what to do about it.
std::string note_of_lag(const TrainingData& data, const LateTarget& late,
                        const GreyBoxSearch::Candidate& chosen, double without) {
  const double lag_ms = 1e3 * late.lag.samples / data.sample_rate_Hz;
  return fmt::format(
      "{0} is late by about {1:.2g} ms: a bank over a rate, which would compensate that on slow "
      "motions and give wrong "
      "values on fast ones, was not added; held out: RMSE {2:.4g} where the lag is taken out, "
      "{3:.4g} with "
      "the bank, {4:.4g} with neither. Write  latency: {{{0}: {1:.2g}ms}}  in the mapping",
      data.target, lag_ms, late.lag.held_out_error, chosen.held_out_error, without);
}

/// Whether the banks over rates only compensate a late target; then without them, with a note.
bool leave_to_latency(ChosenBox& box, const GreyBoxSearch& search, const GreyBoxChoice& main,
                      const GreyBoxSearch::Candidate& chosen, const TrainingData& data,
                      const GreyBoxOptions& options, double rate_share, const Progress& progress) {
  if (!has_bank_over_rate(search.fitted(chosen.choice).terms, data)) return false;
  const auto late = explained_by_lag(data, options.schedule, rate_share, main, chosen, progress);
  if (!late) return false;
  const double without = search.held_out_error(main);
  if (!search.fitted(late->beside).terms.banks.empty())
    keep(box, search, search.rated(late->beside), data, without);
  box.fitted.notes.push_back(note_of_lag(data, *late, chosen, without));
  return true;
}

/// Adds the banks that predict better what is held out; none: the box stays as it is.
void add_banks(ChosenBox& box, const GreyBoxChoice& main, const TrainingData& data,
               const GreyBoxOptions& options, double rate_share, const Progress& progress) {
  FittedGreyBox& fitted = box.fitted;
  const GreyBoxSearch search(data, options.schedule, fitted.parameters.terms);
  const GreyBoxSearch::Candidate chosen = search.choose_banks(main, progress);
  GreyBox::Parameters parameters = search.fitted(chosen.choice);
  if (parameters.terms.banks.empty()) {
    fitted.notes.push_back(
        fmt::format("no bank over another input was added: held out ({}), none gains enough",
                    search.what_was_held_out()));
    return;
  }
  if (leave_to_latency(box, search, main, chosen, data, options, rate_share, progress)) return;
  // The terms of the first input were chosen to describe what the banks describe better.
  GreyBoxChoice line{.is_passive = options.passive, .banks = {}};
  for (const BankChoice& bank : chosen.choice.banks)
    if (!bank.is_empty()) line.banks.push_back(bank);
  const GreyBoxSearch beside(data, options.schedule, rate_share, parameters.terms.banks);
  GreyBoxSearch::Candidate again = beside.choose(line, progress);
  if (again.score < kClearly * chosen.score) {
    GreyBoxTerms::Structure terms = beside.fitted(again.choice).terms;
    terms.banks.clear();
    again.choice.banks.clear();
    const GreyBoxSearch second(data, options.schedule, terms);
    const GreyBoxSearch::Candidate better = second.choose_banks(again.choice, progress);
    if (better.score < kClearly * chosen.score) {
      keep(box, second, better, data, search.held_out_error(main));
      return;
    }
  }
  keep(box, search, chosen, data, search.held_out_error(main));
}

/// The terms that predict best what is held out. Forces of either sign gain in the first steps of a search and lead away
/// from passive terms that predict other recordings better; so where recordings are held out, both are searched. Without
/// rates, a search that ends with forces >= 0 has taken the steps of a passive one.
GreyBoxSearch::Candidate best_terms(const GreyBoxSearch& search, bool passive,
                                    const Progress& progress) {
  GreyBoxSearch::Candidate best = search.choose(passive, progress);
  if (!passive && search.sums().is_by_record && (best.choice.is_signed || search.has_rates())) {
    GreyBoxSearch::Candidate other = search.choose(true, progress);
    if (other.score < best.score) best = std::move(other);
  }
  return search.choose_thresholds(best, progress);
}

/// The box of the terms that predict best what is held out.
ChosenBox chosen_box(const TrainingData& data, const GreyBoxOptions& options, double rate_share,
                     const Progress& progress) {
  GreyBoxSearch of_data(data, options.schedule, rate_share);
  GreyBoxSearch::Candidate best = best_terms(of_data, options.passive, progress);
  ChosenBox box{.search = std::move(of_data), .chosen = std::move(best), .rate_share = rate_share};
  const GreyBoxSearch& search = box.search;
  const GreyBoxSearch::Candidate& chosen = box.chosen;
  FittedGreyBox& fitted = box.fitted;
  fitted.parameters = search.fitted(chosen.choice);
  box.choice = chosen.choice;
  fitted.held_out_rmse = chosen.held_out_error;
  fitted.notes.push_back(fmt::format("{}; held out ({}): RMSE {:.4g}, linear model {:.4g}",
                                     search.description_of(chosen.choice, data),
                                     search.what_was_held_out(), chosen.held_out_error,
                                     search.held_out_error({})));
  if (!options.passive && options.banks && data.input_count() > 1)
    add_banks(box, chosen.choice, data, options, rate_share, progress);
  // With few strokes every fifth is another part of the motion.
  constexpr std::size_t kLeastStrokes = 20;
  if (search.has_one_record() && fitted.parameters.terms.banks.empty() &&
      strokes_of(data) >= kLeastStrokes) {
    const GreyBoxSums spans = gather_spans(data, fitted.parameters.terms);
    box.spans_rmse = GreyBoxCandidate(spans, chosen.choice).held_out().rmse;
    fitted.has_held_out_fifths = std::isfinite(box.spans_rmse);
  }
  fitted.held_out_records = search.held_out_records();
  return box;
}

void take_average(ChosenBox& box, const TrainingData& data) {
  if (!box.fitted.parameters.terms.banks.empty()) return;
  std::optional<BoxAverage> average = box_average(box.search, box.chosen, data, box.rate_share);
  if (!average) return;
  box.fitted.parameters = std::move(average->parameters);
  box.fitted.held_out_rmse = average->held_out_rmse;
  box.fitted.notes.push_back(
      fmt::format("the average of this model and {} whose held-out errors are about as low; held "
                  "out: RMSE {:.4g}",
                  average->boxes - 1, average->held_out_rmse));
}

/// Error bars as wide as the error on the most different part of the data.
void widen(ChosenBox& box, const StrokeErrors& strokes) {
  const char* widest = nullptr;
  const auto to = [&](double rmse, const char* of) {
    if (!(rmse > box.fitted.held_out_rmse)) return;
    box.fitted.held_out_rmse = rmse;
    widest = of;
  };
  to(box.spans_rmse, "contiguous fifths");
  const GreyBoxSums& sums = box.search.sums();
  if (box.fitted.held_out_records < kSeveralRecords)
    to(strokes.rmse, "strokes of other durations");
  else if (sums.is_by_record)  // which already contain strokes of all durations
    box.fitted.held_out_rmse *= error_share_with_all(sums.records, sums.folds);
  if (widest != nullptr)
    box.fitted.notes.push_back(fmt::format(
        "without a validation recording, error bars are those of held-out {}: RMSE {:.4g}", widest,
        box.fitted.held_out_rmse));
  box.fitted.stroke_growth = strokes.growth;
}

}  // namespace

FittedGreyBox fit_grey_box(const TrainingData& data, const GreyBoxOptions& options,
                           const FitContext& context) {
  const bool learns =
      options.residual != ResidualKind::none && options.residual != ResidualKind::automatic;
  if (options.passive && learns)
    throw UsageError({.place = "options passive and residual",
                      .problem = "a learned residual may give energy",
                      .advice = "Leave one of them away."});
  report_progress(context.progress, 0.0, "gathering the terms of grey_box");
  ChosenBox box = chosen_box(data, options, kRateShares[0], context.progress);
  const bool has_rates =
      std::ranges::any_of(data.inputs, [](const auto& input) { return input.is_rate; });
  if (has_rates) {
    ChosenBox other = chosen_box(data, options, kRateShares[1], context.progress);
    if (other.fitted.held_out_rmse < kClearly * box.fitted.held_out_rmse) box = std::move(other);
  }
  const bool may_learn = options.residual != ResidualKind::none && !options.passive;
  FittedGreyBox& fitted = box.fitted;
  StrokeErrors strokes;
  if (!fitted.parameters.coefficients.scheduled)
    strokes = stroke_errors(data, fitted.parameters, box.choice, fitted.held_out_rmse);
  if (options.average) take_average(box, data);
  const double without = fitted.held_out_rmse;
  if (may_learn) learn_residual(fitted, data, options, context);
  fitted.parameters = without_empty_terms(std::move(fitted.parameters));
  // What a network adds is as good there as elsewhere.
  const double gain = fitted.held_out_rmse / without;
  box.spans_rmse *= gain;
  strokes.rmse *= gain;
  widen(box, strokes);
  return std::move(box.fitted);
}

}  // namespace torsio
