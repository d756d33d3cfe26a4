#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "report/fit_report.hpp"
#include "report/html/model_report.hpp"
#include "report/html/report_parts.hpp"
#include "report/html/time_figure_builder.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/estimates.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

ReportTable score_table(const Results& results) {
  ReportTable table{.headings = {"samples of", "RMSE", "MAD", "largest error", "fit %", "samples",
                                 "by a guard", "in 1 sd %", "in 2 sd %", "step ns", "p99.9"},
                    .rows = {}};
  for (const ResultRow& row : results.rows) {
    const Metrics& metrics = row.score.metrics;
    table.rows.push_back(
        {{row.recording ? *row.recording : fmt::format("all {}", name(row.split)),
          error_text(metrics.rmse), error_text(metrics.mad), error_text(metrics.max_abs),
          fixed_text(metrics.fit_percent, 1), fmt::format("{}", metrics.samples),
          fmt::format("{}", row.score.guarded_samples), percent_text(row.score.within_std_dev),
          percent_text(row.score.within_2_std_dev), fmt::format("{:.0f}", row.score.step_ns_p50),
          fmt::format("{:.0f}", row.score.step_ns_p999)},
         row.status == "ok" && row.reason.empty() ? "" : row.status + ": " + row.reason});
  }
  return table;
}

std::vector<std::string> score_summary(const Results& results, const std::string& family) {
  for (const Role role : {Role::test, Role::validation, Role::train})
    for (const ResultRow& row : results.rows) {
      if (row.split != role || row.recording) continue;
      if (row.status != "ok") return {family + " could not be scored: " + row.reason};
      const double guarded = static_cast<double>(row.score.guarded_samples) /
                             static_cast<double>(row.score.metrics.samples);
      return {
          fmt::format("{} on {} {} samples: RMSE {} {}, largest error {} {}.", family,
                      row.score.metrics.samples, name(role), error_text(row.score.metrics.rmse),
                      results.unit, error_text(row.score.metrics.max_abs), results.unit),
          fmt::format("A guard reported a fault in {} % of the samples, and {} % of the errors are "
                      "within two error bars (95.4 % if these are right).",
                      percent_text(guarded), percent_text(row.score.within_2_std_dev))};
    }
  return {};
}

/// Each coefficient over its index, with bars of two standard errors.
XyFigure coefficient_figure(const FitReport& report) {
  XyFigure figure{.title = "Coefficients over two of their standard errors",
                  .x = {"coefficient"},
                  .y = {"|value| / (2 standard errors)", true},
                  .series = {}};
  XySeries ratios{.label = "coefficients", .style = CurveStyle::points, .x = {}, .y = {}};
  XySeries one{
      .label = "not distinguished from 0 below", .role = CurveRole::limit, .x = {}, .y = {}};
  for (const FittedParameter& parameter : report.table) {
    const double ratio = std::abs(parameter.value) / (2.0 * parameter.std_error);
    if (!std::isfinite(ratio)) continue;
    ratios.x.push_back(static_cast<double>(ratios.x.size() + 1));
    ratios.y.push_back(ratio);
    if (report.table.size() <= 20) ratios.names.push_back(parameter.name);
    one.x.push_back(ratios.x.back());
    one.y.push_back(1.0);
  }
  figure.series = {std::move(one), std::move(ratios)};
  return figure;
}

/// The error over the epochs of each network that was trained.
XyFigure training_figure(const std::vector<TrainingEpoch>& history) {
  XyFigure figure{.title = "Training history",
                  .x = {"epoch"},
                  .y = {"RMSE / standard deviation", true},
                  .series = {}};
  std::size_t last = 0;
  std::size_t networks = 0;
  for (const TrainingEpoch& epoch : history) {
    if (epoch.epoch <= last || networks == 0) {
      ++networks;
      for (const char* of : {"training", "held out"})
        figure.series.push_back(
            {.label = networks == 1 ? of : fmt::format("{}, network {}", of, networks),
             .x = {},
             .y = {}});
    }
    last = epoch.epoch;
    const std::array errors = {epoch.training_error, epoch.held_out_error};
    for (std::size_t k = 0; k < 2; ++k) {
      XySeries& series = figure.series[figure.series.size() - 2 + k];
      series.x.push_back(static_cast<double>(epoch.epoch));
      series.y.push_back(errors[k]);
    }
  }
  std::erase_if(figure.series, [](const XySeries& series) {
    return std::ranges::none_of(series.y, [](double error) { return std::isfinite(error); });
  });
  return figure;
}

ReportSection fit_section(const FitReport& report) {
  ReportSection section{.heading = "The fit",
                        .text = fmt::format("Residuals of the {} samples.", report.split),
                        .preformatted = fit_report_text(report)};
  ReportTable correlations{
      .title = "Correlation of the residuals",
      .headings = {"with", "strongest", "at lag [s]", "99 % bound", "lags outside %"},
      .rows = {}};
  for (const ResidualCorrelation& each : report.correlations)
    correlations.rows.push_back(
        {{each.with, fmt::format("{:.3f}", each.strongest), fmt::format("{:.4g}", each.lag_s),
          fmt::format("{:.3f}", each.bound), percent_text(each.share_outside)}});
  section.tables.push_back(std::move(correlations));
  if (report.table.empty()) return section;
  ReportTable table{
      .title = "Coefficients", .headings = {"coefficient", "value", "standard error"}, .rows = {}};
  for (const FittedParameter& parameter : report.table)
    table.rows.push_back(
        {{parameter.name, fmt::format("{:.6g}", parameter.value),
          std::isfinite(parameter.std_error) ? fmt::format("{:.3g}", parameter.std_error) : "-"}});
  section.tables.push_back(std::move(table));
  if (XyFigure figure = coefficient_figure(report); !figure.series.back().x.empty())
    section.figures.emplace_back(std::move(figure));
  return section;
}

}  // namespace

ReportDocument evaluation_report(const Results& results, const std::vector<ScoredRun>& runs,
                                 const ModelFile& file, const std::string& model,
                                 const Dataset& dataset, const Progress& progress) {
  ReportDocument document{.title = "Scores of " + model,
                          .summary = score_summary(results, file.card.fitted_as),
                          .sections = {},
                          .origin = origin_of(dataset)};
  for (const std::string& warning : results.warnings)
    document.summary.push_back("Warning: " + warning + ".");
  document.sections.push_back({.heading = "Scores",
                               .text = fmt::format("Errors in {}, free run.", results.unit),
                               .tables = {score_table(results)}});
  std::ranges::move(model_sections(dataset, {{file.card.fitted_as, &file, &runs}}, progress),
                    std::back_inserter(document.sections));
  document.sections.push_back(card_section(file, "Card of the model"));
  return document;
}

ReportDocument fit_page(const ReportedFit& fit, const std::string& model, const Dataset& dataset,
                        const Progress& progress) {
  ReportDocument document =
      evaluation_report(fit.results, fit.runs, fit.trained.file, model, dataset, progress);
  document.title = "Fit of " + model;
  ReportSection section = fit_section(fit.report);
  for (const std::string& note : fit.trained.notes) section.text += " " + note + ".";
  if (!fit.trained.history.empty())
    section.figures.insert(section.figures.begin(), training_figure(fit.trained.history));
  document.sections.insert(document.sections.begin() + 1, std::move(section));
  return document;
}

ReportDocument estimate_report(const std::vector<EstimatedRecording>& estimated,
                               const std::vector<EstimateSummary>& summaries, const ModelFile& file,
                               const std::string& model) {
  constexpr std::size_t kRecordings = 4;
  const std::string& target = file.settings.target;
  double samples = 0.0;
  double usable = 0.0;
  for (const EstimateSummary& summary : summaries) {
    samples += static_cast<double>(summary.samples);
    usable += summary.usable_share() * static_cast<double>(summary.samples);
  }
  ReportDocument document{
      .title = "Estimates of " + model,
      .summary = {fmt::format(
                      "{} estimated {} in {} recording(s); {} % of {} samples have no fault.",
                      file.card.fitted_as, target, summaries.size(), percent_text(usable / samples),
                      samples),
                  "Nothing measured the target here: the error bars are those of the recordings "
                  "that the model "
                  "was calibrated with."},
      .sections = {},
      .origin = {}};
  document.sections.push_back(
      {.heading = "Recordings", .preformatted = estimates_text(summaries, file.settings)});
  ReportTable table{.headings = {"recording", "samples", "without a fault %", "lowest", "highest",
                                 "largest error bar"},
                    .rows = {}};
  for (const EstimateSummary& summary : summaries)
    table.rows.push_back({{summary.recording, fmt::format("{}", summary.samples),
                           percent_text(summary.usable_share()), error_text(summary.lowest),
                           error_text(summary.highest), error_text(summary.largest_std_dev)}});
  document.sections.back().tables.push_back(std::move(table));
  for (std::size_t r = 0; r < std::min(estimated.size(), kRecordings); ++r) {
    const Recording& channels = estimated[r].channels;
    const std::vector<double>& value = channels.channel(estimate_channel(target)).values;
    const std::vector<double>& std_dev = channels.channel(error_bar_channel(target)).values;
    std::vector<std::uint8_t> faulty;
    for (const Fault fault : estimated[r].faults) faulty.push_back(fault == Fault::none ? 0 : 1);
    std::vector<double> lower(value.size());
    std::vector<double> upper(value.size());
    for (std::size_t n = 0; n < value.size(); ++n) {
      lower[n] = value[n] - 2.0 * std_dev[n];
      upper[n] = value[n] + 2.0 * std_dev[n];
    }
    std::vector<PlaceOfInterest> places = reversals_of(value);
    if (const auto first = std::ranges::find(faulty, 1); first != faulty.end())
      places.push_back({static_cast<std::size_t>(first - faulty.begin()), "first fault"});
    TimeFigureBuilder builder(
        "Time series of " + channels.name(), channels, channels.channels().size() + 3, places,
        values_of_figure(channels.size()) / std::min(estimated.size(), kRecordings));
    builder.panel(fmt::format("{} [{}]", target, unit_label(target)));
    builder.add("estimate lower bound", CurveRole::lower, true, lower);
    builder.add("estimate upper bound", CurveRole::upper, true, upper);
    builder.add("estimate", CurveRole::model, true, value);
    builder.add_channels(channels,
                         {estimate_channel(target), error_bar_channel(target), "novelty_1"});
    builder.mark(faulty, "fault");
    document.sections.push_back({.heading = channels.name(), .figures = {builder.finish()}});
  }
  document.sections.push_back(card_section(file, "Card of the model"));
  return document;
}

}  // namespace torsio
