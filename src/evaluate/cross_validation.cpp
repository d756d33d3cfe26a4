#include "torsio/evaluate/cross_validation.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "evaluate/common_samples.hpp"
#include "evaluate/fold_scores.hpp"

namespace torsio {
namespace {

FoldStatistic statistic(const std::vector<const ResultRow*>& rows, Metrics Score::*metrics,
                        double Metrics::*member) {
  if (rows.empty()) return {};
  const auto count = static_cast<double>(rows.size());
  double mean = 0.0;
  for (const ResultRow* row : rows) mean += row->score.*metrics.*member / count;
  double square_sum = 0.0;
  for (const ResultRow* row : rows) {
    const double deviation = row->score.*metrics.*member - mean;
    square_sum += deviation * deviation;
  }
  return {.mean = mean,
          .std_dev = rows.size() < 2 ? kNotMeasured : std::sqrt(square_sum / (count - 1.0))};
}

/// Mean of a share of the scored samples, over the rows that have one.
double mean_share(const std::vector<const ResultRow*>& rows, double Score::*share) {
  double sum = 0.0;
  double samples = 0.0;
  for (const ResultRow* row : rows) {
    if (!std::isfinite(row->score.*share)) continue;
    const auto count = static_cast<double>(row->score.metrics.samples);
    sum += row->score.*share * count;
    samples += count;
  }
  return sum / samples;
}

void summarise_common(FoldSummary& summary, const std::vector<const ResultRow*>& rows) {
  std::vector<const ResultRow*> ranked;
  for (const ResultRow* row : rows)
    if (row->score.common.samples > 0) ranked.push_back(row);
  summary.ranked_folds = ranked.size();
  summary.common_rmse = statistic(ranked, &Score::common, &Metrics::rmse);
  summary.common_mad = statistic(ranked, &Score::common, &Metrics::mad);
  summary.common_max_abs = statistic(ranked, &Score::common, &Metrics::max_abs);
  summary.common_fit_percent = statistic(ranked, &Score::common, &Metrics::fit_percent);
  const Metrics Score::*metrics = ranked.empty() ? &Score::metrics : &Score::common;
  const auto& among = ranked.empty() ? rows : ranked;
  summary.worst_fold = (*std::ranges::max_element(among, {}, [&](const ResultRow* row) {
                         return (row->score.*metrics).rmse;
                       }))->fold;
}

void summarise(FoldSummary& summary, const std::vector<const ResultRow*>& rows) {
  summary.folds = rows.size();
  if (rows.empty()) return;
  summary.rmse = statistic(rows, &Score::metrics, &Metrics::rmse);
  summary.mad = statistic(rows, &Score::metrics, &Metrics::mad);
  summary.max_abs = statistic(rows, &Score::metrics, &Metrics::max_abs);
  summary.fit_percent = statistic(rows, &Score::metrics, &Metrics::fit_percent);
  summarise_common(summary, rows);
  summary.within_std_dev = mean_share(rows, &Score::within_std_dev);
  summary.within_2_std_dev = mean_share(rows, &Score::within_2_std_dev);
  summary.fit_seconds = 0.0;
  summary.step_ns_p50 = 0.0;
  double guarded = 0.0;
  double samples = 0.0;
  for (const ResultRow* row : rows) {
    summary.fit_seconds += row->fit_seconds;
    summary.step_ns_p50 += row->score.step_ns_p50 / static_cast<double>(rows.size());
    summary.parameter_count = std::max(summary.parameter_count, row->parameter_count);
    guarded += static_cast<double>(row->score.guarded_samples);
    samples += static_cast<double>(row->score.metrics.samples);
  }
  summary.guarded_share = guarded / samples;
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
      summary.status = row.status;
      summary.reason = row.fold + ": " + row.reason;
    }
  }
  summarise(summary, scored);
  return summary;
}

void rank(CrossValidation& validation) {
  const bool is_possible = validation.ranked().is_possible();
  const auto folds = static_cast<std::size_t>(
      std::ranges::count_if(validation.results.rankings, &Ranking::is_possible));
  for (FoldSummary& summary : validation.ranking)
    if (!is_possible || summary.ranked_folds < folds) summary.ranked_folds = 0;
  std::ranges::stable_sort(validation.ranking, [&](const FoldSummary& a, const FoldSummary& b) {
    if ((a.failed_folds == 0) != (b.failed_folds == 0)) return a.failed_folds == 0;
    if ((a.folds == 0) != (b.folds == 0)) return b.folds == 0;
    if ((a.ranked_folds == 0) != (b.ranked_folds == 0)) return b.ranked_folds == 0;
    if (a.ranked_folds > 0) return a.common_rmse.mean < b.common_rmse.mean;
    return false;
  });
}

}  // namespace

Ranking CrossValidation::ranked() const noexcept {
  Ranking all{.split = Role::validation};
  for (const Ranking& of_fold : results.rankings) {
    all.scored_samples += of_fold.scored_samples;
    if (of_fold.is_possible()) all.common_samples += of_fold.common_samples;
  }
  return all;
}

FoldScores::FoldScores(const Dataset& dataset, const FoldScheme& scheme,
                       const std::vector<ModelChoice>& choices, std::uint64_t seed)
    : choices_(choices),
      validation_{.results = empty_results(dataset),
                  .plan = plan_folds(dataset, scheme, seed),
                  .ranking = {}},
      totals_(choices.size()) {
  validation_.results.label = validation_.plan.label;
  for (const ModelChoice& choice : choices_) note_inputs(validation_.results, choice);
  forget_only_set(validation_.results);
  for (Fold& fold : validation_.plan.folds) segments_.push_back(std::exchange(fold.segments, {}));
}

void FoldScores::cut(std::size_t fold, Dataset& dataset) const {
  for (std::size_t i = 0; i < dataset.records.size(); ++i)
    dataset.records[i].segments = segments_[fold][i];
}

void FoldScores::add(std::size_t fold, const Dataset& dataset, std::vector<ScoredModel> models) {
  Results& results = validation_.results;
  results.rankings.push_back(rank_on_common_samples(dataset, Role::test, models));
  results.rankings.back().split = Role::validation;
  for (std::size_t i = 0; i < models.size(); ++i)
    for (ResultRow& row : models[i].rows) {
      if (row.split == Role::train) continue;
      row.split = Role::validation;
      row.fold = validation_.plan.folds[fold].name;
      if (!row.recording) totals_[i].push_back(row);
      results.rows.push_back(std::move(row));
    }
}

CrossValidation FoldScores::summary() && {
  for (std::size_t i = 0; i < choices_.size(); ++i)
    validation_.ranking.push_back(summary_of(choices_[i], totals_[i]));
  rank(validation_);
  return std::move(validation_);
}

CrossValidation cross_validate(Dataset dataset, const std::vector<ModelChoice>& choices,
                               const FoldScheme& scheme, std::uint64_t seed, bool allow_leak,
                               const Progress& progress) {
  FoldScores scores(dataset, scheme, choices, seed);
  InputSets input_sets(dataset, allow_leak);
  std::size_t done = 0;
  const std::size_t fits = scores.plan().folds.size() * choices.size();
  for (std::size_t fold = 0; fold < scores.plan().folds.size(); ++fold) {
    scores.cut(fold, dataset);
    input_sets.forget_data();
    std::vector<ScoredModel> models;
    for (const ModelChoice& choice : choices) {
      const Progress part =
          part_of(progress, done++, fits, choice.family + ", " + scores.plan().folds[fold].name);
      models.push_back(fit_and_score(dataset, input_sets, choice, seed, kFoldRoles, part));
      models.back().trained.reset();
    }
    scores.add(fold, dataset, std::move(models));
  }
  return std::move(scores).summary();
}

}  // namespace torsio
