#include "torsio/evaluate/transfer_curve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/checks.hpp"
#include "core/report_progress.hpp"
#include "evaluate/fit_and_score.hpp"
#include "evaluate/role_samples.hpp"
#include "torsio/evaluate/comparison.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {
namespace {

double training_seconds(const Dataset& dataset) {
  return static_cast<double>(samples_with_role(dataset, Role::train)) / dataset.sample_rate_Hz();
}

double rmse_of(const TransferEvaluation& evaluation, std::string_view method) {
  const TransferEvaluation::OfMethod* const found = evaluation.find(method);
  return found == nullptr ? kNotMeasured : found->test.metrics.rmse;
}

/// The options of the fit, without the entries of a transfer or an adaptation.
std::map<std::string, std::string> fit_options(const ModelCard& card) {
  std::map<std::string, std::string> options = card.options;
  std::erase_if(options, [](const auto& of) { return of.first.find('.') != std::string::npos; });
  return options;
}

void require_positive_time(double seconds) {
  require<UsageError>(seconds > 0.0 && std::isfinite(seconds), "time of the new data that is used",
                      "more than 0 s", as_text(seconds) + " s");
}

}  // namespace

const TransferEvaluation::OfMethod* TransferEvaluation::find(
    std::string_view method) const noexcept {
  const auto found = std::ranges::find(methods, method, &OfMethod::method);
  return found == methods.end() ? nullptr : &*found;
}

TransferEvaluation evaluate_transfer(const ModelFile& base, const Dataset& dataset,
                                     const TransferOptions& options, std::uint64_t seed,
                                     const Progress& progress) {
  if (!dataset.has_role(Role::test))
    throw UsageError({.place = "transfer",
                      .problem = "no part of the recordings is left to score the methods on",
                      .advice = "Give longer recordings, or use less of them."});
  refuse_seen_test_records(dataset);
  TransferEvaluation evaluation{.seconds = training_seconds(dataset),
                                .transfer = transfer_model(base, dataset, options, progress)};
  evaluation.notes = evaluation.transfer.notes;
  for (TransferTrial& trial : evaluation.transfer.trials) {
    const Score test = evaluate(make_estimator(trial.file), dataset, Role::test, progress).together;
    note_held_out_scores(trial.file.card, {{.family = {}, .score = test}});
    evaluation.methods.push_back({.method = std::string(name(trial.method)),
                                  .held_out_rmse = trial.held_out_rmse,
                                  .test = test});
  }
  try {
    const TrainedModel own =
        train_model(dataset,
                    {.family = base.card.fitted_as.empty() ? std::string(base.parameters.family())
                                                           : base.card.fitted_as,
                     .options = fit_options(base.card),
                     .features = base.settings.features},
                    seed, progress);
    evaluation.methods.push_back(
        {.method = "own",
         .test = evaluate(make_estimator(own.file), dataset, Role::test, progress).together});
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    evaluation.notes.push_back(fmt::format("no model of the new data alone: {}", error.what()));
  }
  return evaluation;
}

TransferCurve transfer_curve(const ModelFile& base, const Dataset& dataset,
                             const std::vector<double>& seconds, const TransferOptions& options,
                             std::uint64_t seed, const Progress& progress) {
  const double longest_s = training_seconds(dataset);
  double before_s = 0.0;
  for (const double time_s : seconds) {
    if (!(time_s > before_s && time_s <= longest_s * (1.0 + 1e-9)))
      throw UsageError({.place = "learning curve",
                        .expected = fmt::format("ascending times of at most {:g} s", longest_s),
                        .found = fmt::format("{:g} s", time_s)});
    before_s = time_s;
  }
  TransferCurve curve;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    report_progress(progress, static_cast<double>(i) / static_cast<double>(seconds.size()),
                    "learning curve");
    const TransferEvaluation evaluation =
        evaluate_transfer(base, with_training_time(dataset, seconds[i]), options, seed, {});
    curve.points.push_back({.seconds = seconds[i],
                            .base_rmse = rmse_of(evaluation, "none"),
                            .offset_rmse = rmse_of(evaluation, "offset"),
                            .chosen_rmse = evaluation.chosen().test.metrics.rmse,
                            .own_rmse = rmse_of(evaluation, "own"),
                            .method = evaluation.chosen().method});
  }
  for (std::size_t i = curve.points.size(); i-- > 0;) {
    if (!(curve.points[i].own_rmse <= curve.points[i].chosen_rmse)) break;
    curve.base_helps_until_s = curve.points[i].seconds;
  }
  return curve;
}

Dataset with_training_time(Dataset dataset, double seconds) {
  require_positive_time(seconds);
  auto left = static_cast<std::size_t>(std::llround(seconds * dataset.sample_rate_Hz()));
  for (DatasetRecord& record : dataset.records) {
    for (Segment& segment : record.segments) {
      if (segment.role != Role::train) continue;
      segment.end = std::min(segment.end, segment.begin + left);
      left -= segment.end - segment.begin;
    }
    std::erase_if(record.segments, [](const Segment& of) { return of.begin == of.end; });
  }
  return dataset;
}

void hold_out_after(Dataset& dataset, double seconds) {
  require_positive_time(seconds);
  for (DatasetRecord& record : dataset.records) {
    const std::size_t samples = record.recording.size();
    const auto used =
        static_cast<std::size_t>(std::llround(seconds * record.recording.sample_rate_Hz()));
    if (used >= samples)
      throw Error({.place = record.recording.name(),
                   .expected = fmt::format(
                       "more than {:g} s, so that something is left to score on", seconds),
                   .found = fmt::format(
                       "{:g} s", static_cast<double>(samples) / record.recording.sample_rate_Hz()),
                   .advice = "use less of it, or give other recordings for the scores"});
    record.segments = {{.begin = 0, .end = used, .role = Role::train},
                       {.begin = used, .end = samples, .role = Role::test}};
  }
}

}  // namespace torsio
