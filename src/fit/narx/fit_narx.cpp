#include "fit/narx/fit_narx.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/report_progress.hpp"
#include "fit/common/fitted.hpp"
#include "fit/common/memory_check.hpp"
#include "fit/linear/fit_linear.hpp"
#include "fit/narx/free_run_refinement.hpp"
#include "fit/narx/narx_run.hpp"
#include "numerics/shared_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

void require_usable(const TrainingData& data, const NarxLags& lags) {
  if (data.usable_samples() > 0) return;
  throw Error(
      {.place = "training records",
       .expected = fmt::format("a stretch of measured {} longer than the lags of {} samples",
                               data.target, std::max(lags.inputs, lags.outputs)),
       .found = "none",
       .advice = "Take fewer lags, or give longer records."});
}

/// The regressors of the records for training, and the fit's results for them.
void check_memory(const TrainingData& data, const NarxLags& lags) {
  double samples = 0.0;
  for (const Sequence& sequence : data.sequences)
    samples += static_cast<double>(sequence.target.size());
  const std::size_t regressors = data.input_count() * (lags.inputs + 1) + lags.outputs;
  require_memory({.what = "the table of all samples and lags",
                  .bytes = 4.0 * sizeof(double) * samples * static_cast<double>(regressors),
                  .count = regressors,
                  .counted = "regressors (inputs, their lags, past outputs)",
                  .advice = "Set input_lags and output_lags so that they make {} or less."});
}

}  // namespace

TrainingData narx_data(const TrainingData& data, const NarxLags& lags, const OutputLists* outputs) {
  check_lags(lags);
  check_memory(data, lags);
  TrainingData result{
      .inputs = {}, .target = data.target, .sample_rate_Hz = data.sample_rate_Hz, .sequences = {}};
  const auto lagged = [](const std::string& name, std::size_t lag) {
    return lag == 0 ? name : fmt::format("lag({}, {})", name, lag);
  };
  for (std::size_t lag = 0; lag <= lags.inputs; ++lag)
    for (const InputInfo& input : data.inputs)
      result.inputs.push_back({lagged(input.expression, lag), input.is_rate});
  for (std::size_t lag = 1; lag <= lags.outputs; ++lag)
    result.inputs.push_back({lagged(data.target, lag), false});

  const std::size_t most = std::max(lags.inputs, lags.outputs);
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const Sequence& from = data.sequences[s];
    const std::vector<double>& past = outputs == nullptr ? from.target : (*outputs)[s];
    Sequence to{.recording = from.recording,
                .features = Matrix(from.target.size(), result.inputs.size()),
                .target = from.target,
                .use = from.use};
    for (std::size_t n = 0; n < from.target.size(); ++n) {
      if (n < most) {
        to.use[n] = 0;
        continue;
      }
      auto at = to.features.row(n).begin();
      for (std::size_t lag = 0; lag <= lags.inputs; ++lag)
        at = std::ranges::copy(from.features.row(n - lag), at).out;
      for (std::size_t lag = 1; lag <= lags.outputs; ++lag) *at++ = past[n - lag];
      if (!to.has_features(n)) to.use[n] = 0;
    }
    result.sequences.push_back(std::move(to));
  }
  require_usable(result, lags);
  return result;
}

FittedModel fit_narx(const TrainingData& data, const NarxOptions& options, const NarxInner& inner,
                     const FitContext& context) {
  const TargetSpread spread = spread_of(data);
  const Narx<Linear>::Parameters rest = narx_frame(data, options.lags, options.range, spread);
  const std::size_t rounds = options.training == NarxTraining::free_run ? options.rounds : 0;
  const TrainingData& evaluation = context.validation == nullptr ? data : *context.validation;
  require_free_run(evaluation);
  std::optional<TrainingData> validation;
  if (context.validation != nullptr) validation = narx_data(*context.validation, options.lags);

  OutputLists outputs;
  if (options.training == NarxTraining::noise)
    outputs = noisy_targets(data, options.noise * spread.deviation, context.seed);
  std::optional<FittedModel> best;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best_round = 0;
  for (std::size_t round = 0; round <= rounds; ++round) {
    FitContext own{
        .seed = context.seed, .progress = {}, .validation = validation ? &*validation : nullptr};
    const double share = 1.0 / static_cast<double>(rounds + 1);
    own.progress = share_of(context.progress, static_cast<double>(round) * share,
                            static_cast<double>(round + 1) * share);
    own.error_of = [&](const AnyModel& f) {
      AnyModel model = inner.wrap(f, rest);
      return free_run_rmse(simulated(model, evaluation), evaluation);
    };
    FittedModel f =
        inner.fit(narx_data(data, options.lags, outputs.empty() ? nullptr : &outputs), own);
    AnyModel model = inner.wrap(f.model, rest);
    const double rmse = free_run_rmse(simulated(model, evaluation), evaluation);
    if (!best || rmse < least || !std::isfinite(least)) {
      least = rmse;
      best_round = round;
      best = FittedModel{.model = model, .notes = std::move(f.notes), .table = std::move(f.table)};
    }
    if (round < rounds) outputs = simulated(model, data);
  }
  best->notes.push_back(
      fmt::format("free run on {}: RMSE {:.4g} in the target's unit{}",
                  context.validation == nullptr ? "the training records" : "the validation records",
                  least, rounds == 0 ? "" : fmt::format(" (round {} of {})", best_round, rounds)));
  return *std::move(best);
}

namespace {

/// b + sum k_i r_i as terms.
NarxTerms line_of(const Linear::Parameters& line) {
  NarxTerms f{.terms = {{}}, .scales = {}, .coefficients = line.coefficients.values.values};
  for (std::size_t i = 0; i + 1 < f.coefficients.size(); ++i) f.terms.push_back({i});
  f.scales.assign(f.terms.size() - 1, 1.0);
  return f;
}

}  // namespace

Fitted<Narx<Linear>> fit_arx(const TrainingData& data, const ArxOptions& options,
                             const FitContext& context) {
  report_progress(context.progress, 0.0, "fitting arx");
  const TrainingData regressors = narx_data(data, options.lags);
  Fitted<Linear> f = fit_linear(regressors, {.rates = true});
  Narx<Linear>::Parameters parameters =
      narx_frame(data, options.lags, options.range, spread_of(data));
  parameters.model = f.parameters;
  if (!options.is_refined) return {parameters, std::move(f.notes)};
  require_free_run(data);

  const auto rmse_of = [&](const Narx<Linear>::Parameters& of) {
    Narx<Linear> model(of);
    return free_run_rmse(simulated(model, data), data);
  };
  report_progress(context.progress, 0.3, "refining arx");
  Refined refined = refined_in_free_run(line_of(f.parameters), data, regressors, options.lags,
                                        share_of(context.progress, 0.3, 1.0));
  Narx<Linear>::Parameters better = parameters;
  better.model.coefficients.values.values = std::move(refined.coefficients);
  const double before = rmse_of(parameters);
  const double after = rmse_of(better);
  f.notes.push_back(refinement_note(before, after, refined.report));
  return {after < before ? better : parameters, std::move(f.notes)};
}

}  // namespace torsio
