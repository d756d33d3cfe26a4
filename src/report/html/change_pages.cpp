#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/adaptation.hpp"
#include "report/drift.hpp"
#include "report/html/model_report.hpp"
#include "report/html/report_parts.hpp"
#include "report/html/time_figure_builder.hpp"
#include "report/monitor.hpp"
#include "report/result_parts.hpp"
#include "report/transfer.hpp"
#include "torsio/core/units.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

void append(ReportDocument& document, std::vector<ReportSection> sections) {
  std::ranges::move(sections, std::back_inserter(document.sections));
}

/// One column for each name.
XyFigure columns(std::string title, std::string y_label, const std::string& label,
                 const std::vector<std::pair<std::string, double>>& values) {
  XySeries series{.label = label, .style = CurveStyle::columns, .x = {}, .y = {}};
  for (const auto& [value_name, value] : values) {
    series.x.push_back(static_cast<double>(series.x.size()));
    series.y.push_back(value);
    series.names.push_back(value_name);
  }
  return {.title = std::move(title),
          .x = {""},
          .y = {std::move(y_label)},
          .series = {std::move(series)}};
}

XyFigure learning_curve(const TransferCurve& curve, const std::string& unit) {
  XyFigure figure{.title = "Error over the time of the new data",
                  .x = {"time of the new data [s]"},
                  .y = {fmt::format("RMSE [{}]", unit)},
                  .series = {}};
  const auto add = [&](const char* label, double TransferCurve::Point::*error) {
    XySeries series{.label = label, .x = {}, .y = {}};
    for (const TransferCurve::Point& point : curve.points) {
      series.x.push_back(point.seconds);
      series.y.push_back(point.*error);
    }
    figure.series.push_back(std::move(series));
  };
  add("base", &TransferCurve::Point::base_rmse);
  add("constant offset", &TransferCurve::Point::offset_rmse);
  add("transferred", &TransferCurve::Point::chosen_rmse);
  add("new data alone", &TransferCurve::Point::own_rmse);
  return figure;
}

/// The change of each quantity and its interval, over the smallest change that counts.
XyFigure drift_figure(const Drift& drift) {
  XyFigure figure{.title = "Changes over the smallest change that counts",
                  .x = {""},
                  .y = {"change / smallest change that counts"},
                  .series = {}};
  XySeries changes{.label = "change", .style = CurveStyle::columns, .x = {}, .y = {}};
  XySeries intervals{.label = "95 % interval", .role = CurveRole::measured, .x = {}, .y = {}};
  for (const DriftQuantity& quantity : drift.quantities) {
    const auto at = static_cast<double>(changes.x.size());
    changes.x.push_back(at);
    changes.y.push_back(quantity.change / quantity.smallest);
    changes.names.push_back(quantity.name);
    for (const double end : {quantity.lowest, quantity.highest}) {
      intervals.x.push_back(at);
      intervals.y.push_back(end / quantity.smallest);
    }
    intervals.x.push_back(kNotMeasured);
    intervals.y.push_back(kNotMeasured);
  }
  figure.series = {std::move(changes), std::move(intervals)};
  return figure;
}

TimeFigure monitor_figure(const MonitorReplay& replay) {
  const Recording& channels = replay.estimated.channels;
  std::vector<PlaceOfInterest> places;
  std::vector<TimeMark> marks;
  const auto mark = [&](double at_s, double end_s, const std::string& label, bool is_failure) {
    const double sample = (at_s - channels.time_s(0)) * channels.sample_rate_Hz();
    if (!(sample >= 0.0) || sample >= static_cast<double>(channels.size())) return;
    places.push_back(
        {static_cast<std::size_t>(sample), fmt::format("{} at {:.3f} s", label, at_s)});
    marks.push_back({.begin_s = at_s, .end_s = end_s, .label = label, .is_failure = is_failure});
  };
  const double last_s = channels.time_s(channels.size() - 1);
  if (std::isfinite(replay.stopped_at_s)) mark(replay.stopped_at_s, last_s, "stop", true);
  for (const MonitorReplay::Finding& event : replay.events)
    mark(event.t_s, event.t_s, fmt::format("{}: {}", name(event.action), name(event.check)), false);
  for (const MonitorReplay::Injection& injection : replay.injections)
    mark(injection.start_s, injection.start_s, "injected: " + injection.fault, false);
  TimeFigure figure =
      channels_figure(channels, "Torques of the sources and the monitor", std::move(places), {});
  figure.marks = std::move(marks);
  return figure;
}

}  // namespace

ReportDocument attribution_report(const Attribution& attribution,
                                  const AttributionSubject& subject) {
  const std::string unit = unit_label(subject.target);
  ReportTable table{.headings = {"input", fmt::format("mean |phi| [{}]", unit), "share %",
                                 fmt::format("RMSE increase when shuffled [{}]", unit)},
                    .rows = {}};
  std::vector<std::pair<std::string, double>> shapley;
  const InputAttribution* largest = nullptr;
  for (const InputAttribution& input : attribution.inputs) {
    table.rows.push_back({{input.input, error_text(input.mean_abs_shapley),
                           percent_text(input.share), error_text(input.rmse_increase)}});
    shapley.emplace_back(input.input, input.mean_abs_shapley);
    if (largest == nullptr || input.mean_abs_shapley > largest->mean_abs_shapley) largest = &input;
  }
  ReportDocument document{.title = "Inputs that " + subject.model + " uses",
                          .summary = {},
                          .sections = {},
                          .origin = {}};
  if (largest != nullptr)
    document.summary.push_back(fmt::format("{} of {} uses {} most: {} % of the Shapley values.",
                                           subject.family, subject.model, largest->input,
                                           percent_text(largest->share)));
  document.summary.emplace_back(kAttributionCaveat);
  ReportSection section{.heading = "Inputs",
                        .tables = {std::move(table)},
                        .preformatted = attribution_text(attribution, subject)};
  section.figures.emplace_back(
      columns("Mean of |phi| of each input", fmt::format("[{}]", unit), "Shapley values", shapley));
  document.sections.push_back(std::move(section));
  return document;
}

ReportDocument adaptation_report(const AdaptedModel& adapted, const ModelFile& frozen,
                                 const std::string& model, const Dataset& dataset,
                                 const Progress& progress) {
  const std::string unit = unit_label(adapted.file.settings.target);
  ReportTable table{.headings = {"samples", "recording", "frozen RMSE", "adapted RMSE",
                                 "frozen MAD", "adapted MAD"},
                    .rows = {}};
  const auto add = [&](const char* samples, const std::vector<AdaptationScore>& scores) {
    for (const AdaptationScore& score : scores)
      table.rows.push_back({{samples, score.recording.empty() ? "all" : score.recording,
                             error_text(score.frozen.rmse), error_text(score.adapted.rmse),
                             error_text(score.frozen.mad), error_text(score.adapted.mad)}});
  };
  add("as it ran", adapted.as_it_ran);
  add("held out", adapted.held_out);
  const AdaptationScore& held_out = adapted.held_out.back();
  ReportDocument document{
      .title = "Adaptation of " + model,
      .summary =
          {fmt::format(
               "On held-out samples the error is {} {} after the adaptation and {} {} before it.",
               error_text(held_out.adapted.rmse), unit, error_text(held_out.frozen.rmse), unit),
           held_out.adapted.rmse > held_out.frozen.rmse
               ? "The adapted model is worse: do not use it."
               : "The adapted model is not worse."},
      .sections = {},
      .origin = origin_of(dataset)};
  document.sections.push_back({.heading = "Errors",
                               .text = fmt::format("RMSE and MAD in {}.", unit),
                               .tables = {std::move(table)},
                               .preformatted = adaptation_text(adapted, model)});
  append(document,
         model_sections(dataset, {{"adapted", &adapted.file}, {"frozen", &frozen}}, progress));
  document.sections.push_back(card_section(adapted.file, "Card of the adapted model"));
  return document;
}

ReportDocument transfer_report(const TransferEvaluation& evaluation, const TransferCurve& curve,
                               const ModelFile& base, const Dataset& dataset,
                               const Progress& progress) {
  const std::string& target = base.settings.target;
  const std::string unit = unit_label(target);
  ReportTable table{
      .headings = {"method", "held-out RMSE", "RMSE on the test samples", "guarded samples"},
      .rows = {}};
  for (const TransferEvaluation::OfMethod& method : evaluation.methods)
    table.rows.push_back(
        {{method.method, error_text(method.held_out_rmse), error_text(method.test.metrics.rmse),
          fmt::format("{}", method.test.guarded_samples)}});
  ReportDocument document{
      .title = "Transfer to another joint",
      .summary = {fmt::format(
          "With {:.3g} s of new data, {} was chosen: RMSE {} {} on the test samples.",
          evaluation.seconds, evaluation.chosen().method,
          error_text(evaluation.chosen().test.metrics.rmse), unit)},
      .sections = {},
      .origin = origin_of(dataset)};
  if (const auto* own = evaluation.find("own"))
    document.summary.push_back(fmt::format("A model of the new data alone has {} {}.",
                                           error_text(own->test.metrics.rmse), unit));
  ReportSection section{.heading = "Methods",
                        .tables = {std::move(table)},
                        .preformatted = transfer_text(evaluation, curve, target)};
  if (!curve.points.empty()) section.figures.emplace_back(learning_curve(curve, unit));
  document.sections.push_back(std::move(section));
  append(
      document,
      model_sections(dataset, {{"transferred", &evaluation.transfer.best().file}, {"base", &base}},
                     progress));
  return document;
}

ReportDocument drift_report(const Drift& drift, const ModelFile& file, const Dataset& dataset,
                            const Progress& progress) {
  const std::string unit = unit_label(file.settings.target);
  ReportTable table{
      .headings = {"quantity", "unit", "before", "change", "95 % from", "to", "verdict"},
      .rows = {}};
  for (const DriftQuantity& quantity : drift.quantities)
    table.rows.push_back(
        {{quantity.name, quantity.unit, fmt::format("{:.4g}", quantity.before),
          fmt::format("{:.4g}", quantity.change), fmt::format("{:.4g}", quantity.lowest),
          fmt::format("{:.4g}", quantity.highest), std::string(name(quantity.verdict))},
         quantity.reason});
  ReportDocument document{
      .title = "What has changed in the joint",
      .summary = {fmt::format("The joint: {}; advice: {}.", name(drift.joint), name(drift.advice)),
                  fmt::format(
                      "The model has an RMSE of {} {} here and had {} {} at its calibration.",
                      error_text(drift.rmse), unit, error_text(drift.calibration_rmse), unit)},
      .sections = {},
      .origin = origin_of(dataset)};
  document.sections.push_back({.heading = "Quantities",
                               .tables = {std::move(table)},
                               .figures = {drift_figure(drift)},
                               .preformatted = drift_text(drift, file.settings.target)});
  append(document, model_sections(dataset, {{file.card.fitted_as, &file}}, progress));
  document.sections.push_back(card_section(file, "Card of the model"));
  return document;
}

ReportDocument monitor_report(const std::vector<MonitorReplay>& replays,
                              const MonitorSettings& settings) {
  const auto stopped = std::ranges::count_if(
      replays, [](const MonitorReplay& replay) { return std::isfinite(replay.stopped_at_s); });
  ReportDocument document{.title = "Replay through a monitor",
                          .summary = {fmt::format("The monitor stopped in {} of {} recording(s).",
                                                  stopped, replays.size()),
                                      "A recording without a stop does not prove a sound joint: "
                                      "docs/robot/safety.md states what none of the "
                                      "checks detects."},
                          .sections = {},
                          .origin = {}};
  ReportSection findings{.heading = "Findings", .preformatted = replays_text(replays, settings)};
  findings.tables.push_back(words_table(verdict_table(replays)));
  if (const TextTable found = finding_table(replays, settings); !found.rows().empty())
    findings.tables.push_back(words_table(found, "Findings over time"));
  document.sections.push_back(std::move(findings));
  constexpr std::size_t kRecordings = 4;
  for (std::size_t r = 0; r < std::min(replays.size(), kRecordings); ++r)
    document.sections.push_back(
        {.heading = replays[r].estimated.channels.name(), .figures = {monitor_figure(replays[r])}});
  return document;
}

}  // namespace torsio
