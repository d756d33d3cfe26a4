#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/html/model_report.hpp"
#include "report/html/report_parts.hpp"
#include "report/html/speed_loops.hpp"
#include "report/html/time_figure_builder.hpp"
#include "report/identify.hpp"
#include "report/result_parts.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/inputs.hpp"
#include "torsio/report/check.hpp"
#include "torsio/report/html/verb_reports.hpp"
#include "torsio/report/tracking.hpp"

namespace torsio {
namespace {

XyFigure loop_figure(std::string title, std::string x_label, std::string y_label,
                     std::span<const double> x, std::span<const double> y,
                     const Recording& recording) {
  ThinnedCurve thin = thinned(x, y);
  XySeries loop{.label = "measured", .x = std::move(thin.x), .y = std::move(thin.y)};
  for (const std::size_t n : thin.kept) loop.colour.push_back(recording.time_s(n));
  return {.title = std::move(title),
          .x = {std::move(x_label)},
          .y = {std::move(y_label)},
          .series = {std::move(loop)},
          .colour_label = "time, from dark at the start to light at the end"};
}

std::size_t count(const std::vector<Finding>& findings, Verdict verdict) {
  return static_cast<std::size_t>(std::ranges::count(findings, verdict, &Finding::verdict));
}

/// What the loop is for comes first: reference, answer and the error between them.
TimeFigure loop_signals(const Recording& record) {
  TimeFigureBuilder builder("Signals of the loop", record, record.channels().size() + 1, {},
                            values_of_figure(record.size()));
  const std::vector<double>& wanted = record.channel("wanted_torque_Nm").values;
  const std::vector<double>& answer = record.channel("truth_torque_Nm").values;
  std::vector<double> error(wanted.size());
  for (std::size_t n = 0; n < error.size(); ++n) error[n] = wanted[n] - answer[n];
  builder.panel("torque [Nm]");
  builder.add("wanted_torque_Nm", CurveRole::measured, true, wanted);
  builder.add("truth_torque_Nm", CurveRole::model, true, answer);
  builder.panel("error [Nm]");
  builder.add("error", CurveRole::model, true, error);
  builder.add_channels(record, {"wanted_torque_Nm", "truth_torque_Nm"});
  return builder.finish();
}

}  // namespace

ReportDocument check_report(const std::vector<Finding>& findings, const Dataset* dataset,
                            const FeatureSpec& spec, const Advice* advice,
                            const std::vector<DriveAdvice>& drive_advice) {
  const Verdict verdict = worst(findings);
  ReportDocument document{
      .title = "Check of recordings",
      .summary = {verdict == Verdict::fail ? "Fix what failed before a model is trained."
                  : verdict == Verdict::warn
                      ? "A model can be trained on these recordings; read the warnings."
                      : "A model can be trained on these recordings.",
                  fmt::format("{} check(s) failed, {} warned, {} passed.",
                              count(findings, Verdict::fail), count(findings, Verdict::warn),
                              count(findings, Verdict::pass))},
      .sections = {},
      .origin = dataset != nullptr ? origin_of(*dataset)
                                   : std::vector<std::pair<std::string, std::string>>{}};
  ReportTable table{.headings = {"verdict", "check", "recording", "found", "advice"},
                    .rows = {},
                    .is_words = true};
  for (const Finding& finding : findings)
    table.rows.push_back({{std::string(name(finding.verdict)), finding.check, finding.recording,
                           finding.message, finding.advice}});
  document.sections.push_back({.heading = "Findings", .tables = {std::move(table)}});
  if (advice != nullptr)
    document.sections.push_back(
        {.heading = "What to record next", .preformatted = advice_text(*advice)});
  if (!drive_advice.empty())
    document.sections.push_back({.heading = "What to record next for torsio identify",
                                 .tables = {report_table(drive_advice_table(drive_advice))}});
  if (dataset == nullptr) return document;
  constexpr std::size_t kRecordings = 6;
  for (std::size_t r = 0; r < std::min(dataset->records.size(), kRecordings); ++r) {
    const Recording& recording = dataset->records[r].recording;
    ReportSection section{.heading = recording.name(),
                          .text = fmt::format("{} samples at {:g} Hz.", recording.size(),
                                              recording.sample_rate_Hz())};
    const std::vector<double> input = first_feature(recording, spec);
    std::vector<PlaceOfInterest> places;
    std::vector<TimeMark> marks;
    for (const Finding& finding : findings) {
      if (finding.recording != recording.name() || finding.verdict == Verdict::pass) continue;
      for (const SampleRange& range : finding.places) {
        places.push_back({range.begin, fmt::format("{} at {:.2f} s", finding.check,
                                                   recording.time_s(range.begin))});
        marks.push_back({.begin_s = recording.time_s(range.begin),
                         .end_s = recording.time_s(range.end),
                         .label = finding.check + ": " + finding.message,
                         .is_failure = finding.verdict == Verdict::fail});
      }
    }
    TimeFigure series = channels_figure(recording, "Channels over time", std::move(places), input);
    series.marks = std::move(marks);
    section.figures.emplace_back(
        loop_figure(fmt::format("{} over {}", dataset->target, spec.inputs.front()),
                    with_unit(spec.inputs.front()), with_unit(dataset->target), input,
                    recording.channel(dataset->target).values, recording));
    section.figures.emplace_back(speed_loops(spec.inputs.front(), input, dataset->target,
                                             recording.channel(dataset->target).values,
                                             recording.sample_rate_Hz()));
    section.figures.emplace_back(std::move(series));
    document.sections.push_back(std::move(section));
  }
  return document;
}

ReportDocument simulation_report(const Recording& recording, std::span<const double> twist_rad,
                                 const std::string& title) {
  ReportDocument document{
      .title = title,
      .summary =
          {fmt::format("A simulated recording of {:.4g} s with {} channels at {:g} Hz.",
                       static_cast<double>(recording.size()) / recording.sample_rate_Hz(),
                       recording.channels().size(), recording.sample_rate_Hz()),
           "Its noise, offsets and friction are those of the data sheet; a real joint differs."},
      .sections = {},
      .origin = {}};
  ReportSection section{.heading = "Recording"};
  section.figures.emplace_back(loop_figure("Torque over the measured twist", "deflection [rad]",
                                           "torque [Nm]", twist_rad,
                                           recording.channel("torque_Nm").values, recording));
  section.figures.emplace_back(channels_figure(recording, "Channels over time", {}, twist_rad));
  document.sections.push_back(std::move(section));
  return document;
}

ReportDocument tracking_report(std::span<const TrackingRow> rows, const Recording* record) {
  ReportDocument document{.title = "Torque tracking", .summary = {}, .sections = {}, .origin = {}};
  ReportSection scores{.heading = "Models", .preformatted = tracking_text(rows)};
  ReportTable table{.headings = {"model", "seed", "MAD [Nm]", "RMS [Nm]", "largest [Nm]",
                                 "MAD to linear", "bandwidth [Hz]", "status"},
                    .rows = {}};
  const TrackingRow* best = nullptr;
  for (const TrackingRow& row : rows) {
    const auto or_dash = [](const std::optional<double>& value) {
      return value ? fmt::format("{:.3g}", *value) : std::string("-");
    };
    table.rows.push_back({{row.model, fmt::format("{}", row.seed), error_text(row.score.mad),
                           error_text(row.score.rmse), error_text(row.score.max_abs),
                           or_dash(row.mad_to_linear), or_dash(row.bandwidth_Hz), row.status},
                          row.reason});
    if (row.status == "ok" && (best == nullptr || row.score.mad < best->score.mad)) best = &row;
  }
  scores.tables.push_back(std::move(table));
  if (best != nullptr)
    document.summary = {
        fmt::format("{} follows the {} of {:g} Nm on {} best: mean absolute error {} Nm.",
                    best->model, best->reference, best->amplitude_Nm, best->actuator,
                    error_text(best->score.mad)),
        "The bench is simulated, and the gains are computed from its data sheet."};
  else
    document.summary = {"No run ended: the table states why."};
  document.sections.push_back(std::move(scores));
  if (record != nullptr)
    document.sections.push_back({.heading = "One run",
                                 .text = "Reference, answer, error, each term of the command, and "
                                         "at a click what no sensor measures (truth).",
                                 .figures = {loop_signals(*record)}});
  return document;
}

ReportDocument text_report(std::string title, std::vector<std::string> summary,
                           const std::string& text, std::vector<ReportFigure> figures) {
  ReportDocument document{
      .title = std::move(title), .summary = std::move(summary), .sections = {}, .origin = {}};
  document.sections.push_back(
      {.heading = "Result", .figures = std::move(figures), .preformatted = text});
  return document;
}

}  // namespace torsio
