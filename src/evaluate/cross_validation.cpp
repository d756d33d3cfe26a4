#include "torsio/evaluate/cross_validation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "evaluate/fit_and_score.hpp"

namespace torsio {
namespace {

constexpr std::array kHeldOut{Role::test};

FoldStatistic statistic(const std::vector<const ResultRow*>& rows, double Metrics::*member) {
  if (rows.empty()) return {};
  const auto count = static_cast<double>(rows.size());
  double mean = 0.0;
  for (const ResultRow* row : rows) mean += row->score.metrics.*member / count;
  double square_sum = 0.0;
  for (const ResultRow* row : rows) {
    const double deviation = row->score.metrics.*member - mean;
    square_sum += deviation * deviation;
  }
  return {.mean = mean,
          .std_dev = rows.size() < 2 ? kNotMeasured : std::sqrt(square_sum / (count - 1.0))};
}

void summarise(FoldSummary& summary, const std::vector<const ResultRow*>& rows) {
  summary.folds = rows.size();
  if (rows.empty()) return;
  summary.rmse = statistic(rows, &Metrics::rmse);
  summary.mad = statistic(rows, &Metrics::mad);
  summary.max_abs = statistic(rows, &Metrics::max_abs);
  summary.fit_percent = statistic(rows, &Metrics::fit_percent);
  summary.fit_seconds = 0.0;
  summary.step_ns_p50 = 0.0;
  double guarded = 0.0;
  double samples = 0.0;
  const ResultRow* worst = rows.front();
  for (const ResultRow* row : rows) {
    summary.fit_seconds += row->fit_seconds;
    summary.step_ns_p50 += row->score.step_ns_p50 / static_cast<double>(rows.size());
    summary.parameter_count = std::max(summary.parameter_count, row->parameter_count);
    guarded += static_cast<double>(row->score.guarded_samples);
    samples += static_cast<double>(row->score.metrics.samples);
    if (row->score.metrics.rmse > worst->score.metrics.rmse) worst = row;
  }
  summary.guarded_share = guarded / samples;
  summary.worst_fold = worst->fold;
}

/// @param totals the model's row on all that each fold holds out.
FoldSummary summary_of(const ModelChoice& choice, const std::vector<ResultRow>& totals) {
  FoldSummary summary{
      .family = choice.family, .variant = choice.variant(), .input_set = choice.input_set};
  std::vector<const ResultRow*> scored;
  for (const ResultRow& row : totals) {
    summary.leak |= row.leak;
    if (row.status == "ok") {
      scored.push_back(&row);
    } else if (summary.failed_folds++ == 0) {
      summary.reason = row.fold + ": " + row.reason;
    }
  }
  summarise(summary, scored);
  return summary;
}

void rank(std::vector<FoldSummary>& summaries) {
  std::ranges::stable_sort(summaries, [](const FoldSummary& a, const FoldSummary& b) {
    if ((a.failed_folds == 0) != (b.failed_folds == 0)) return a.failed_folds == 0;
    if ((a.folds == 0) != (b.folds == 0)) return b.folds == 0;
    return a.rmse.mean < b.rmse.mean;
  });
}

}  // namespace

CrossValidation cross_validate(Dataset dataset, const std::vector<ModelChoice>& choices,
                               const FoldScheme& scheme, std::uint64_t seed, bool allow_leak,
                               const Progress& progress) {
  CrossValidation validation{
      .results = empty_results(dataset), .plan = plan_folds(dataset, scheme, seed), .ranking = {}};
  Results& results = validation.results;
  results.label = validation.plan.label;
  for (const ModelChoice& choice : choices) note_inputs(results, choice);
  forget_only_set(results);
  InputSets input_sets(dataset, allow_leak);
  std::vector<std::vector<ResultRow>> totals(choices.size());
  std::size_t done = 0;
  const std::size_t fits = validation.plan.folds.size() * choices.size();
  for (Fold& fold : validation.plan.folds) {
    for (std::size_t i = 0; i < dataset.records.size(); ++i)
      dataset.records[i].segments = std::move(fold.segments[i]);
    fold.segments.clear();
    input_sets.forget_data();
    for (std::size_t i = 0; i < choices.size(); ++i) {
      const ModelChoice& choice = choices[i];
      const Progress part = part_of(progress, done++, fits, choice.family + ", " + fold.name);
      ScoredModel scored = fit_and_score(dataset, input_sets, choice, seed, kHeldOut, part);
      for (ResultRow& row : scored.rows) {
        row.split = Role::validation;
        row.fold = fold.name;
        if (!row.recording) totals[i].push_back(row);
        results.rows.push_back(std::move(row));
      }
    }
  }
  for (std::size_t i = 0; i < choices.size(); ++i)
    validation.ranking.push_back(summary_of(choices[i], totals[i]));
  rank(validation.ranking);
  return validation;
}

}  // namespace torsio
