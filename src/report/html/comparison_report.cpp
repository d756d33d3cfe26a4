#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/cross_validation.hpp"
#include "report/html/model_report.hpp"
#include "report/html/report_parts.hpp"
#include "report/result_parts.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/results.hpp"

namespace torsio {
namespace {

Role last_role(const Results& results) {
  const bool has_test = std::ranges::any_of(
      results.rows, [](const ResultRow& row) { return row.split == Role::test; });
  return has_test ? Role::test : Role::validation;
}

/// On the samples without those of guards, where there is a ranking, as in the table.
const Metrics& ranked_metrics(const ResultRow& row) {
  return row.score.common.samples > 0 ? row.score.common : row.score.metrics;
}
double ranked_error(const ResultRow& row) { return ranked_metrics(row).rmse; }

/// The largest error of the table, and that with the samples of guards where it is larger.
std::string largest_error_text(const ResultRow& row, const std::string& unit) {
  const double ranked = ranked_metrics(row).max_abs;
  const double all = row.score.metrics.max_abs;
  std::string text = fmt::format("{} {}", error_text(ranked), unit);
  if (all > ranked)
    text += fmt::format(" ({} {} with the samples that a guard reported)", error_text(all), unit);
  return text;
}

/// What the row of a table opens: settings, remarks and the scores on each recording.
std::string details_of(const Results& results, const ResultRow& of) {
  std::string text = fmt::format(
      "{} parameters, fitted in {} s. Without the samples of guards: {} of {}.", of.parameter_count,
      seconds_text(of.fit_seconds), of.score.guarded_samples, of.score.metrics.samples);
  if (!of.reason.empty()) text += fmt::format("\n{}", of.reason);
  for (const ResultRow& row : results.rows)
    if (row.recording && row.split == of.split && row.family == of.family &&
        row.variant == of.variant && row.input_set == of.input_set)
      text += fmt::format("\n{}, with the samples of guards: RMSE {}, largest error {}, {} samples",
                          *row.recording, error_text(row.score.metrics.rmse),
                          error_text(row.score.metrics.max_abs), row.score.metrics.samples);
  return text;
}

ReportSection ranking_section(const Results& results, Role split) {
  const RankedRows ranked = ranked_rows(results, split);
  ReportTable table = report_table(ranked.table);
  for (std::size_t i = 0; i < table.rows.size(); ++i)
    table.rows[i].details = details_of(results, *ranked.rows[i]);
  ReportSection section{
      .heading = fmt::format("Models on the {} recordings", name(split)),
      .text = fmt::format("Errors in {}, free run. A row opens with a click on its name.",
                          results.unit),
      .tables = {std::move(table)}};
  for (const Ranking& ranking : results.rankings)
    if (ranking.split == split)
      if (const std::string note = ranking_note(ranking); !note.empty()) section.text += " " + note;
  if (!ranked.others.empty()) {
    ReportTable others{
        .title = "Not in the ranking", .headings = {"model", "why"}, .rows = {}, .is_words = true};
    for (const RankedRows::Other& other : ranked.others)
      others.rows.push_back({{model_label(*other.row), other.reason}});
    section.tables.push_back(std::move(others));
  }
  return section;
}

ReportSection warning_section(const std::vector<std::string>& warnings) {
  ReportTable table{.headings = {"warning"}, .rows = {}, .is_words = true};
  for (const std::string& warning : warnings) table.rows.push_back({{warning}});
  return {.heading = "Warnings", .tables = {std::move(table)}};
}

/// Error against the cost of a step. The front: no other model is better and cheaper.
XyFigure cost_figure(const Results& results, const std::vector<const ResultRow*>& rows) {
  XySeries models{.label = "models", .style = CurveStyle::points, .x = {}, .y = {}};
  XySeries front{.label = "Pareto front", .role = CurveRole::limit, .x = {}, .y = {}};
  std::vector<const ResultRow*> by_cost = rows;
  std::ranges::sort(by_cost, {}, [](const ResultRow* row) { return row->score.step_ns_p50; });
  double best = std::numeric_limits<double>::infinity();
  for (const ResultRow* row : by_cost) {
    const double error = ranked_error(*row);
    models.x.push_back(row->score.step_ns_p50);
    models.y.push_back(error);
    models.names.push_back(model_label(*row));
    if (!(error < best)) continue;
    best = error;
    front.x.push_back(row->score.step_ns_p50);
    front.y.push_back(error);
  }
  return {.title = "Error against the time of a step",
          .x = {"median time of a step [ns]", true},
          .y = {fmt::format("RMSE [{}]", results.unit), true},
          .series = {std::move(front), std::move(models)}};
}

/// The models in the order of the table.
std::vector<ReportedModel> in_order_of(const std::vector<const ResultRow*>& rows,
                                       const std::vector<ComparedModel>& models) {
  std::vector<ReportedModel> ordered;
  for (const ResultRow* row : rows)
    for (const ComparedModel& model : models)
      if (model.family == row->family && model.variant == row->variant &&
          model.input_set == row->input_set)
        ordered.push_back({model_label(*row), &model.file});
  return ordered;
}

}  // namespace

ReportDocument comparison_report(const Comparison& comparison, const Dataset& dataset,
                                 const Progress& progress) {
  const Results& results = comparison.results;
  const Role split = last_role(results);
  const RankedRows ranked = ranked_rows(results, split);
  ReportDocument document{.title = "Comparison of models of " + results.target,
                          .summary = {},
                          .sections = {},
                          .origin = origin_of(dataset)};
  if (ranked.rows.empty()) {
    document.summary = {"No model could be fitted and scored; the table states why."};
  } else {
    const ResultRow& best = *ranked.rows.front();
    document.summary = {fmt::format(
        "{} has the smallest error of {} models on the {} recordings: RMSE {} {}, largest error "
        "{}.",
        model_label(best), ranked.rows.size(), name(split), error_text(ranked_error(best)),
        results.unit, largest_error_text(best, results.unit))};
    document.summary.push_back(fmt::format(
        "{} % of its errors are within two of its error bars (95.4 % if these are right){}.",
        percent_text(best.score.within_2_std_dev),
        ranked.others.empty()
            ? ""
            : fmt::format("; {} more could not be ranked", ranked.others.size())));
  }
  for (const Role role : {Role::validation, Role::test})
    if (std::ranges::any_of(results.rows, [&](const ResultRow& row) { return row.split == role; }))
      document.sections.push_back(ranking_section(results, role));
  if (!ranked.rows.empty())
    document.sections.back().figures.emplace_back(cost_figure(results, ranked.rows));
  if (!results.warnings.empty()) document.sections.push_back(warning_section(results.warnings));
  const std::vector<ReportedModel> models = in_order_of(ranked.rows, comparison.models);
  std::ranges::move(model_sections(dataset, models, progress),
                    std::back_inserter(document.sections));
  if (comparison.best)
    document.sections.push_back(card_section(comparison.best->file, "Card of the best model"));
  return document;
}

ReportDocument cross_validation_report(const CrossValidation& validation, const Dataset& dataset) {
  const Results& results = validation.results;
  ReportDocument document{.title = "Cross-validation of models of " + results.target,
                          .summary = {},
                          .sections = {},
                          .origin = origin_of(dataset)};
  ReportTable table{.headings = {"model", "RMSE", "+-", "MAD", "largest error", "folds", "step ns"},
                    .rows = {}};
  XyFigure folds{.title = "Error in each fold",
                 .x = {"fold"},
                 .y = {fmt::format("RMSE [{}]", results.unit), true},
                 .series = {}};
  for (const FoldSummary& summary : validation.ranking) {
    const bool is_ranked = summary.ranked_folds > 0;
    const FoldStatistic& rmse = is_ranked ? summary.common_rmse : summary.rmse;
    const std::string label = model_label(summary.family, summary.variant);
    table.rows.push_back(
        {{label, error_text(rmse.mean), error_text(rmse.std_dev), error_text(summary.mad.mean),
          error_text(summary.max_abs.mean), fmt::format("{}", summary.folds),
          fmt::format("{:.0f}", summary.step_ns_p50)},
         summary.reason.empty() ? "" : fmt::format("{}: {}", summary.status, summary.reason)});
    XySeries series{.label = label, .is_shown = folds.series.size() < 6, .x = {}, .y = {}};
    for (std::size_t f = 0; f < validation.plan.folds.size(); ++f)
      for (const ResultRow& row : results.rows)
        if (!row.recording && row.fold == validation.plan.folds[f].name &&
            row.family == summary.family && row.variant == summary.variant &&
            row.input_set == summary.input_set) {
          series.x.push_back(static_cast<double>(f + 1));
          series.y.push_back(ranked_error(row));
        }
    folds.series.push_back(std::move(series));
  }
  if (!validation.ranking.empty()) {
    const FoldSummary& best = validation.ranking.front();
    const FoldStatistic& rmse = best.ranked_folds > 0 ? best.common_rmse : best.rmse;
    document.summary = {
        fmt::format("{} has the smallest mean error over {} folds: RMSE {} +- {} {}.",
                    model_label(best.family, best.variant), validation.plan.folds.size(),
                    error_text(rmse.mean), error_text(rmse.std_dev), results.unit),
        "The standard deviation is that of one fold; folds share training data, so that it is not "
        "the error of "
        "the mean."};
  }
  document.sections.push_back({.heading = "Models",
                               .text = validation.plan.label,
                               .tables = {std::move(table)},
                               .figures = {std::move(folds)},
                               .preformatted = cross_validation_table(validation)});
  return document;
}

}  // namespace torsio
