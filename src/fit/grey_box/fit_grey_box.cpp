#include "fit/grey_box/fit_grey_box.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/folds.hpp"
#include "fit/common/model_run.hpp"
#include "fit/grey_box/grey_box_search.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/network/fit_network.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// Share of a rate's root mean square over which dry friction changes its sign: the whole of it, or
/// nearly a step.
constexpr std::array kRateShares{0.2, 0.02};
constexpr double kClearly = 0.99;  // less of the held-out error

/// What the box leaves over, with its slips as further inputs.
TrainingData residual_data(const TrainingData& data, const GreyBox::Parameters& parameters) {
  TrainingData left{.inputs = data.inputs,
                    .target = data.target,
                    .sample_rate_Hz = data.sample_rate_Hz,
                    .sequences = {}};
  const std::size_t slips = parameters.terms.thresholds.size();
  for (std::size_t i = 0; i < slips; ++i)
    left.inputs.push_back({.expression = fmt::format("slip {}", i + 1)});
  for (const Sequence& sequence : data.sequences) {
    GreyBox box(parameters);
    Sequence& own = left.sequences.emplace_back(
        Sequence{.recording = sequence.recording,
                 .features = Matrix(sequence.features.rows, data.input_count() + slips),
                 .target = sequence.target,
                 .use = sequence.use});
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      std::ranges::copy(sequence.features.row(n), own.features.row(n).begin());
      if (!sequence.has_features(n)) continue;
      own.target[n] -= box.step(sequence.features.row(n)).value;
      std::ranges::copy(box.state().first(slips),
                        own.features.row(n).subspan(data.input_count()).begin());
    }
  }
  return left;
}

double rms_of(const TrainingData& data, AnyModel* model) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Sequence& sequence : data.sequences) {
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
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

/// The samples of one fold for evaluation, and the others for training.
std::pair<TrainingData, TrainingData> parted(const TrainingData& data) {
  std::pair<TrainingData, TrainingData> parts{data, data};
  for (std::size_t s = 0; s < data.sequences.size(); ++s) {
    const std::size_t samples = data.sequences[s].use.size();
    for (std::size_t n = 0; n < samples; ++n) {
      const bool is_scored = interleaved_fold(n, samples) == 0;
      (is_scored ? parts.first : parts.second).sequences[s].use[n] = 0;
    }
  }
  return parts;
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

void learn_residual(FittedGreyBox& fitted, const TrainingData& data, const GreyBoxOptions& options,
                    const FitContext& context) {
  const TrainingData left = residual_data(data, fitted.parameters);
  const double rms = rms_of(left, nullptr);
  if (options.residual == ResidualKind::automatic) {
    constexpr double kWorthwhile = 0.98;
    const auto [learned, scored] = parted(left);
    AnyModel trial = residual_model(learned, options.residual, context);
    const double without = rms_of(scored, nullptr);
    const double with = rms_of(scored, &trial);
    const bool is_kept = with < kWorthwhile * without;
    fitted.notes.push_back(
        fmt::format("a network for the residual was {}: RMSE on a held-out fifth of the data "
                    "{:.4g} with it, {:.4g} "
                    "without",
                    is_kept ? "added" : "not added", with, without));
    if (!is_kept) return;
    fitted.held_out_rmse *= with / without;
  }
  fitted.parameters.residual =
      residual_of(residual_model(left, options.residual, context), left, options.bound * rms);
}

/// The box of the terms that predict best what is held out.
FittedGreyBox chosen_box(const TrainingData& data, const GreyBoxOptions& options, double rate_share,
                         const Progress& progress) {
  const GreyBoxSearch search(data, options.schedule, rate_share);
  const GreyBoxSearch::Candidate chosen = search.choose(options.passive, progress);
  FittedGreyBox fitted;
  fitted.parameters = search.fitted(chosen.choice);
  fitted.held_out_rmse = chosen.held_out_error;
  fitted.notes.push_back(fmt::format(
      "{}; held out ({}): RMSE {:.4g}, linear model {:.4g}", search.description_of(chosen.choice),
      search.what_was_held_out(), chosen.held_out_error, search.held_out_error({})));
  return fitted;
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
  FittedGreyBox fitted = chosen_box(data, options, kRateShares[0], context.progress);
  const bool has_rates =
      std::ranges::any_of(data.inputs, [](const auto& input) { return input.is_rate; });
  if (has_rates) {
    FittedGreyBox other = chosen_box(data, options, kRateShares[1], context.progress);
    if (other.held_out_rmse < kClearly * fitted.held_out_rmse) fitted = std::move(other);
  }
  const bool may_learn = options.residual != ResidualKind::none && !options.passive;
  if (may_learn) learn_residual(fitted, data, options, context);
  return fitted;
}

}  // namespace torsio
