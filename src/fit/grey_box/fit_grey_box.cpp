#include "fit/grey_box/fit_grey_box.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "fit/common/folds.hpp"
#include "fit/common/model_run.hpp"
#include "fit/grey_box/grey_box_search.hpp"
#include "fit/mixture/fit_dgmm.hpp"
#include "fit/network/fit_network.hpp"
#include "numerics/parallel.hpp"
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

/// Restricts the used samples to the scored fold, or to the others, as long as it lives.
class PartInUse {
 public:
  PartInUse(ResidualData& left, bool scored) : left_(left) {
    for (std::size_t s = 0; s < left.is_scored.size(); ++s) {
      std::vector<std::uint8_t>& use = left.samples.sequences[s].use;
      all_.push_back(use);
      for (std::size_t n = 0; n < use.size(); ++n)
        if ((left.is_scored[s][n] != 0) != scored) use[n] = 0;
    }
  }
  ~PartInUse() {
    for (std::size_t s = 0; s < all_.size(); ++s)
      left_.samples.sequences[s].use = std::move(all_[s]);
  }
  PartInUse(const PartInUse&) = delete;
  PartInUse& operator=(const PartInUse&) = delete;

 private:
  ResidualData& left_;
  std::vector<std::vector<std::uint8_t>> all_;
};

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
  ResidualData left = residual_data(data, fitted.parameters, options.residual);
  const double rms = rms_of(left.samples, nullptr);
  if (options.residual == ResidualKind::automatic) {
    constexpr double kWorthwhile = 0.98;
    AnyModel trial = [&] {
      const PartInUse others(left, false);
      return residual_model(left.samples, options.residual, context);
    }();
    const PartInUse scored(left, true);
    const double without = rms_of(left.samples, nullptr);
    const double with = rms_of(left.samples, &trial);
    const bool is_kept = with < kWorthwhile * without;
    fitted.notes.push_back(
        fmt::format("a network for the residual was {}: RMSE on a held-out fifth of the data "
                    "{:.4g} with it, {:.4g} "
                    "without",
                    is_kept ? "added" : "not added", with, without));
    if (!is_kept) return;
    fitted.held_out_rmse *= with / without;
  }
  fitted.parameters.residual = residual_of(residual_model(left.samples, options.residual, context),
                                           left.samples, options.bound * rms);
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
