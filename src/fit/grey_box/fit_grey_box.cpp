#include "fit/grey_box/fit_grey_box.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/folds.hpp"
#include "fit/common/held_out.hpp"
#include "fit/common/model_run.hpp"
#include "fit/grey_box/grey_box_search.hpp"
#include "fit/grey_box/late_target.hpp"
#include "fit/grey_box/stroke_errors.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/network/fit_network.hpp"
#include "numerics/parallel.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Share of a rate's root mean square over which dry friction changes its sign: the whole of it, or
/// nearly a step.
constexpr std::array kRateShares{0.2, 0.02};
constexpr double kClearly = 0.99;  // less of the held-out error

/// What a box leaves over, with its slips as further inputs.
struct ResidualData {
  TrainingData samples;
  /// By sequence, 1 for each sample of the fold that a trial is scored on.
  std::vector<std::vector<std::uint8_t>> is_scored = {};
};

/// Whether a trial of a network holds out whole records. If it holds out the end of the only one, it
/// needs the place of each sample in the record.
bool holds_out_records(const TrainingData& data) {
  const auto is_learned = [](const Sequence& sequence) {
    const std::size_t samples = sequence.use.size();
    for (std::size_t n = 0; n < samples; ++n)
      if (sequence.use[n] != 0 && interleaved_fold(n, samples) != 0) return true;
    return false;
  };
  return std::ranges::count_if(data.sequences, is_learned) > 1;
}

/// The residual of one record: at every sample, or only at those to learn from, of which a slow load
/// cell has few.
void add_residual(ResidualData& left, std::size_t s, const Sequence& sequence,
                  const GreyBox::Parameters& parameters, bool whole) {
  const std::size_t samples = sequence.target.size();
  const std::size_t inputs = sequence.features.columns;
  const std::size_t slips = parameters.terms.thresholds.size();
  const auto is_kept = [&](std::uint8_t use) { return whole || use != 0; };
  const auto kept = static_cast<std::size_t>(std::ranges::count_if(sequence.use, is_kept));
  Sequence own{.recording = sequence.recording, .features = Matrix(kept, inputs + slips)};
  std::vector<std::uint8_t>& is_scored = left.is_scored[s];
  GreyBox box(parameters);
  for (std::size_t n = 0; n < samples; ++n) {
    const auto features = sequence.features.row(n);
    const bool has_features = sequence.has_features(n);
    const double estimate = has_features ? box.step(features).value : 0.0;
    if (!is_kept(sequence.use[n])) continue;
    const auto row = own.features.row(own.target.size());
    std::ranges::copy(features, row.begin());
    if (has_features) std::ranges::copy(box.state().first(slips), row.subspan(inputs).begin());
    own.target.push_back(sequence.target[n] - estimate);
    own.use.push_back(sequence.use[n]);
    is_scored.push_back(interleaved_fold(n, samples) == 0 ? 1 : 0);
  }
  left.samples.sequences[s] = std::move(own);
}

ResidualData residual_data(const TrainingData& data, const GreyBox::Parameters& parameters,
                           ResidualKind kind) {
  ResidualData left{.samples = {.inputs = data.inputs,
                                .target = data.target,
                                .sample_rate_Hz = data.sample_rate_Hz,
                                .sequences = {}}};
  for (std::size_t i = 0; i < parameters.terms.thresholds.size(); ++i)
    left.samples.inputs.push_back({.expression = fmt::format("slip {}", i + 1)});
  // The fit of a mixture names a sample that it refuses.
  const bool whole = kind == ResidualKind::dgmm || !holds_out_records(data);
  left.samples.sequences.resize(data.sequences.size());
  left.is_scored.resize(data.sequences.size());
  for_each_chunk(data.sequences.size(), 0, [&](std::size_t s) {
    add_residual(left, s, data.sequences[s], parameters, whole);
  });
  return left;
}

/// @param fold 1 for each sample that counts, by sequence; null: all in use
double rms_of(const TrainingData& data, AnyModel* model,
              const std::vector<std::vector<std::uint8_t>>* fold = nullptr) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& sequence = data.sequences[s];
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0 || (fold != nullptr && (*fold)[s][n] == 0)) continue;
      const double estimate = model == nullptr ? 0.0 : model->step(sequence.features.row(n)).value;
      sum += (sequence.target[n] - estimate) * (sequence.target[n] - estimate);
      ++count;
    }
  }
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(count, 1)));
}

AnyModel residual_model(const TrainingData& data, ResidualKind kind, const FitContext& context) {
  if (kind == ResidualKind::dgmm)
    return Dgmm(fit_dgmm(data, {.online = {.components = 50}}, context.progress).parameters);
  FitContext own{.seed = context.seed, .progress = context.progress};
  return Mlp(fit_mlp(data, {.layers = {16, 16}, .activation = Activation::tanh}, own).parameters);
}

/// The samples outside the scored fold.
TrainingData others_of(const ResidualData& left) {
  TrainingData others = left.samples;
  for (std::size_t s = 0; s < others.sequences.size(); ++s)
    for (std::size_t n = 0; n < left.is_scored[s].size(); ++n)
      if (left.is_scored[s][n] != 0) others.sequences[s].use[n] = 0;
  return others;
}

GreyBoxResidual residual_of(const AnyModel& model, const TrainingData& data, double bound) {
  GreyBoxResidual residual{.bound = bound};
  if (const Mlp* const mlp = model.get_if<Mlp>()) residual.model = mlp->parameters();
  if (const Dgmm* const dgmm = model.get_if<Dgmm>()) residual.model = dgmm->parameters();
  residual.lowest.assign(data.input_count(), std::numeric_limits<double>::infinity());
  residual.highest.assign(data.input_count(), -std::numeric_limits<double>::infinity());
  for (const Sequence& sequence : data.sequences) {
    for (std::size_t n = 0; n < sequence.use.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      for (std::size_t j = 0; j < data.input_count(); ++j) {
        residual.lowest[j] = std::min(residual.lowest[j], sequence.features(n, j));
        residual.highest[j] = std::max(residual.highest[j], sequence.features(n, j));
      }
    }
  }
  return residual;
}

/// What a network for the residual achieves on the fold that it did not learn from.
struct Trial {
  double with = 0.0;  ///< RMSE; without it likewise
  double without = 0.0;
  [[nodiscard]] bool is_worthwhile() const {
    constexpr double kWorthwhile = 0.98;
    return with < kWorthwhile * without;
  }
};

Trial trial_of(const ResidualData& left, ResidualKind kind, const FitContext& context) {
  AnyModel model = residual_model(others_of(left), kind, context);
  return {.with = rms_of(left.samples, &model, &left.is_scored),
          .without = rms_of(left.samples, nullptr, &left.is_scored)};
}

/// A network for the residual if a trial shows that it is worthwhile. It is fitted at the same time
/// as the trial, on another thread if there is one, and given up if the trial fails.
std::pair<Trial, std::optional<AnyModel>> tried_model(const ResidualData& left, ResidualKind kind,
                                                      const FitContext& context) {
  ProgressOfParts progress(context.progress, 2);
  std::atomic<bool> is_given_up = false;
  Trial trial;
  std::optional<AnyModel> model;
  std::exception_ptr failure;
  const auto try_it = [&] {
    try {
      trial = trial_of(left, kind, {.seed = context.seed, .progress = progress.part(0)});
      is_given_up = !trial.is_worthwhile();
    } catch (...) {
      is_given_up = true;
      throw;
    }
  };
  const auto fit_it = [&] {
    const Progress part = progress.part(1);
    const Progress unless_given_up = [&](double fraction, std::string_view doing) {
      return !is_given_up && (!part || part(fraction, doing));
    };
    if (is_given_up) return;
    try {
      model =
          residual_model(left.samples, kind, {.seed = context.seed, .progress = unless_given_up});
    } catch (...) {
      failure = std::current_exception();  // does not matter if the trial fails
    }
  };
  for_each_chunk(2, 0, [&](std::size_t chunk) { chunk == 0 ? try_it() : fit_it(); });
  if (!trial.is_worthwhile()) return {trial, std::nullopt};
  if (failure) std::rethrow_exception(failure);
  return {trial, std::move(model)};
}

void learn_residual(FittedGreyBox& fitted, const TrainingData& data, const GreyBoxOptions& options,
                    const FitContext& context) {
  const ResidualData left = residual_data(data, fitted.parameters, options.residual);
  std::optional<AnyModel> model;
  if (options.residual == ResidualKind::automatic) {
    Trial trial;
    std::tie(trial, model) = tried_model(left, options.residual, context);
    fitted.notes.push_back(
        fmt::format("a network for the residual was {}: RMSE on a held-out fifth of the data "
                    "{:.4g} with it, {:.4g} "
                    "without",
                    model ? "added" : "not added", trial.with, trial.without));
    if (!model) return;
    fitted.held_out_rmse *= trial.with / trial.without;
  } else {
    model = residual_model(left.samples, options.residual, context);
  }
  fitted.parameters.residual =
      residual_of(*model, left.samples, options.bound * rms_of(left.samples, nullptr));
}

/// A box, the terms that it was fitted for, and the error where a contiguous fifth of a single recording is held out; 0:
/// none was.
struct ChosenBox {
  FittedGreyBox fitted;
  GreyBoxChoice choice = {};
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

/// The box of the terms that predict best what is held out.
ChosenBox chosen_box(const TrainingData& data, const GreyBoxOptions& options, double rate_share,
                     const Progress& progress) {
  const GreyBoxSearch search(data, options.schedule, rate_share);
  const GreyBoxSearch::Candidate chosen = search.choose(options.passive, progress);
  ChosenBox box;
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
  }
  fitted.held_out_records = search.held_out_records();
  return box;
}

/// Error bars as wide as the error on the most different part of the data.
void widen(ChosenBox& box, const StrokeErrors& strokes) {
  const auto to = [&](double rmse, const char* of) {
    if (!(rmse > box.fitted.held_out_rmse)) return;
    box.fitted.held_out_rmse = rmse;
    box.fitted.notes.push_back(
        fmt::format("error bars are those of held-out {}: RMSE {:.4g}", of, rmse));
  };
  to(box.spans_rmse, "contiguous fifths");
  // Whole recordings that were held out already contain strokes of all durations.
  if (box.fitted.held_out_records < kSeveralRecords) to(strokes.rmse, "strokes of other durations");
  box.fitted.stroke_growth = strokes.growth;
}

}  // namespace

FittedGreyBox fit_grey_box(const TrainingData& data, const GreyBoxOptions& options,
                           const FitContext& context) {
  const bool learns =
      options.residual == ResidualKind::mlp || options.residual == ResidualKind::dgmm;
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
  const double without = fitted.held_out_rmse;
  StrokeErrors strokes;
  if (!fitted.parameters.coefficients.scheduled)
    strokes = stroke_errors(data, fitted.parameters, box.choice, without);
  if (may_learn) learn_residual(fitted, data, options, context);
  // What a network adds is as good there as elsewhere.
  const double gain = fitted.held_out_rmse / without;
  box.spans_rmse *= gain;
  strokes.rmse *= gain;
  widen(box, strokes);
  return std::move(box.fitted);
}

}  // namespace torsio
