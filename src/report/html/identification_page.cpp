#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "identify/drive/drive_document.hpp"
#include "identify/drive/drive_friction.hpp"
#include "report/html/report_parts.hpp"
#include "report/html/time_figure_builder.hpp"
#include "report/identify.hpp"
#include "torsio/joint_load/known_load.hpp"
#include "torsio/report/html/verb_reports.hpp"

namespace torsio {
namespace {

/// Whether the recordings are others than those of the fit.
bool is_evaluated(const DriveIdentification& identified) { return identified.groups == 0; }

/// The free runs of a recording.
struct DriveRuns {
  const Recording* recording = nullptr;
  DriveTrace fitted;
  DriveTrace held_out;  ///< by the fit without its group; empty: none
};

std::vector<DriveRuns> runs_of(const DriveIdentification& identified,
                               const std::vector<Recording>& recordings) {
  std::vector<DriveRuns> runs;
  for (std::size_t k = 0; k < recordings.size(); ++k) {
    runs.push_back({&recordings[k], simulate_drive(identified, recordings[k]), {}});
    if (identified.held_out_values.size() != recordings.size()) continue;
    DriveIdentification without = identified;
    without.values = identified.held_out_values[k];
    runs.back().held_out = simulate_drive(without, recordings[k]);
  }
  return runs;
}

std::vector<double> difference_of(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> difference(a.size());
  for (std::size_t n = 0; n < a.size(); ++n) difference[n] = a[n] - b[n];
  return difference;
}

TimeFigure motion_figure(const DriveRuns& runs) {
  const Recording& recording = *runs.recording;
  const bool has_held_out = !runs.held_out.angle_rad.empty();
  TimeFigureBuilder builder("Angle of " + recording.name(), recording, 6, {},
                            values_of_figure(recording.size()));
  builder.panel("angle [rad]");
  builder.add("measured", CurveRole::measured, true, runs.fitted.measured_rad);
  builder.add("simulated", CurveRole::model, true, runs.fitted.angle_rad);
  if (has_held_out) builder.add("held out", CurveRole::model, true, runs.held_out.angle_rad);
  builder.panel("simulated - measured [rad]");
  builder.add("simulated", CurveRole::model, true,
              difference_of(runs.fitted.angle_rad, runs.fitted.measured_rad));
  if (has_held_out)
    builder.add("held out", CurveRole::model, true,
                difference_of(runs.held_out.angle_rad, runs.held_out.measured_rad));
  builder.panel("torque of the joint [Nm]");
  builder.add("simulated", CurveRole::model, true, runs.fitted.joint_torque_Nm);
  if (recording.has("enabled_1")) {
    std::vector<std::uint8_t> is_off;
    for (const double on : recording.channel("enabled_1").values)
      is_off.push_back(on == 0.0 ? 1 : 0);
    builder.mark(is_off, "power off");
  }
  return builder.finish();
}

/// A table whose rows have the numbers that the figures refer to; that of the mean has none.
ReportTable numbered(ReportTable table, std::size_t rows) {
  table.headings.insert(table.headings.begin(), "no.");
  for (std::size_t k = 0; k < table.rows.size(); ++k)
    table.rows[k].cells.insert(table.rows[k].cells.begin(),
                               k < rows ? fmt::format("{}", k + 1) : std::string());
  return table;
}

/// Errors of the free runs, one column for each recording.
XyFigure errors_figure(const DriveIdentification& identified) {
  XyFigure figure{.title = "Mean |error of the angle| of each free run",
                  .x = {"no. in the table"},
                  .y = {"[rad]"},
                  .series = {}};
  const auto add = [&](const char* label, CurveStyle style, CurveRole role,
                       double DriveRecordingScore::*error) {
    XySeries series{.label = label, .style = style, .role = role, .x = {}, .y = {}};
    bool has_any = false;
    for (std::size_t k = 0; k < identified.recordings.size(); ++k) {
      series.x.push_back(static_cast<double>(k + 1));
      series.y.push_back(identified.recordings[k].*error);
      has_any = has_any || std::isfinite(series.y.back());
    }
    if (has_any) figure.series.push_back(std::move(series));
  };
  add(is_evaluated(identified) ? "error" : "fitted", CurveStyle::columns, CurveRole::model,
      &DriveRecordingScore::mae_rad);
  add("held out", CurveStyle::points, CurveRole::measured, &DriveRecordingScore::held_out_mae_rad);
  add("nested", CurveStyle::points, CurveRole::limit, &DriveRecordingScore::nested_mae_rad);
  return figure;
}

/// 95 % intervals as horizontal lines, one above the other: over the value where the parameter is positive, else over the
/// standard error.
XyFigure intervals_figure(const DriveIdentification& identified, bool of_positive) {
  XyFigure figure{
      .title = of_positive ? "95 % intervals of positive parameters, over the value"
                           : "95 % intervals of the other parameters, over the standard error",
      .x = {of_positive ? "parameter / its value" : "parameter / its standard error", of_positive},
      .y = {"no. in the table"},
      .series = {}};
  XySeries values{.label = "value", .style = CurveStyle::points, .x = {}, .y = {}};
  XySeries determined{.label = "95 % interval", .role = CurveRole::measured, .x = {}, .y = {}};
  XySeries others{.label = "not determined", .role = CurveRole::limit, .x = {}, .y = {}};
  for (std::size_t k = 0; k < identified.parameters.size(); ++k) {
    const IdentifiedDriveParameter& parameter = identified.parameters[k];
    if (drive_parameter_info(parameter.parameter).is_positive != of_positive ||
        !std::isfinite(parameter.lowest))
      continue;
    const double unit = of_positive ? parameter.value : parameter.standard_error;
    if (!(unit > 0.0)) continue;
    const auto row = static_cast<double>(k + 1);
    values.x.push_back(parameter.value / unit);
    values.y.push_back(row);
    values.names.emplace_back(drive_parameter_info(parameter.parameter).name);
    XySeries& intervals = parameter.is_determined.value_or(true) ? determined : others;
    intervals.x.insert(intervals.x.end(),
                       {parameter.lowest / unit, parameter.highest / unit, kNotMeasured});
    intervals.y.insert(intervals.y.end(), {row, row, kNotMeasured});
  }
  for (XySeries* series : {&determined, &others, &values})
    if (!series->x.empty()) figure.series.push_back(std::move(*series));
  return figure;
}

double speed_rad_s(const DriveTrace& trace, std::size_t n) {
  return n == 0 ? 0.0 : (trace.angle_rad[n] - trace.angle_rad[n - 1]) * trace.sample_rate_Hz;
}

/// The largest load of the friction in a free run, L of the equations of `DriveParameter`. With one mass it needs the
/// motor's torque, which is that of the joint and the friction.
double largest_load_Nm(const DriveIdentification& identified, const DriveRuns& run) {
  const DriveTrace& trace = run.fitted;
  const bool has_spring = has(identified.terms, DriveTerm::spring);
  const JointLoad load = known_load(identified.load, *run.recording).load;
  const double zero_rad = load.zero_rad + at(identified.values, DriveParameter::zero);
  const double direction = at(identified.values, DriveParameter::direction);
  double largest_Nm = 0.0;
  for (std::size_t n = 0; n < trace.angle_rad.size(); ++n) {
    const double joint_Nm = trace.joint_torque_Nm[n];
    const double gravity_Nm = -load.gravity_Nm * std::sin(trace.joint_angle_rad[n] + zero_rad);
    const auto load_of = [&](double motor_Nm) {
      return std::abs(motor_Nm * (1.0 + direction) - gravity_Nm * (1.0 - direction));
    };
    const double speed = speed_rad_s(trace, n);
    const double friction_Nm = drive_friction_Nm(identified.values, speed, load_of(joint_Nm));
    const double motor_Nm = speed == 0.0 ? joint_Nm : joint_Nm + std::copysign(friction_Nm, speed);
    largest_Nm = std::max(largest_Nm, has_spring ? std::abs(joint_Nm) : load_of(motor_Nm));
  }
  return largest_Nm;
}

/// Friction over the speeds of the recordings at four loads up to the largest one that the free runs have.
XyFigure friction_figure(const DriveIdentification& identified,
                         const std::vector<DriveRuns>& runs) {
  double fastest_rad_s = 0.0;
  double largest_Nm = 0.0;
  for (const DriveRuns& run : runs) {
    largest_Nm = std::max(largest_Nm, largest_load_Nm(identified, run));
    for (std::size_t n = 0; n < run.fitted.angle_rad.size(); ++n)
      fastest_rad_s = std::max(fastest_rad_s, std::abs(speed_rad_s(run.fitted, n)));
  }
  XyFigure figure{.title = "Largest friction over speed and load",
                  .x = {"speed [rad/s]", true},
                  .y = {"friction [Nm]"},
                  .series = {}};
  constexpr std::size_t kPoints = 120;
  constexpr std::array kShares{0.0, 0.25, 0.5, 1.0};
  for (const double share : kShares) {
    XySeries curve{
        .label = fmt::format("at a load L of {:.3g} Nm", share * largest_Nm), .x = {}, .y = {}};
    for (std::size_t k = 0; k < kPoints; ++k) {
      const double decades = 3.0 * (static_cast<double>(k) / (kPoints - 1) - 1.0);
      const double speed = fastest_rad_s * std::pow(10.0, decades);
      curve.x.push_back(speed);
      curve.y.push_back(drive_friction_Nm(identified.values, speed, share * largest_Nm));
    }
    figure.series.push_back(std::move(curve));
  }
  return figure;
}

ReportSection findings_section(const DriveIdentification& identified,
                               const std::vector<DriveAdvice>& advice) {
  ReportSection section{.heading = "Findings, and what to record next"};
  ReportTable findings{.headings = {"verdict", "subject", "found"}, .rows = {}, .is_words = true};
  for (const DriveFinding& finding : identified.findings)
    findings.rows.push_back(
        {{finding.is_failure ? "FAIL" : "WARN", finding.subject, finding.text}});
  if (!findings.rows.empty()) section.tables.push_back(std::move(findings));
  if (!advice.empty())
    section.tables.push_back(
        report_table(drive_advice_table(advice), "Recordings that lower a standard error most"));
  return section;
}

ReportSection parameters_section(const DriveIdentification& identified) {
  ReportSection section{
      .heading = "Parameters",
      .text =
          "All quantities are after the gear. A positive parameter whose 95 % interval spans more "
          "than a factor of 10, and another one whose interval spans more than half of its range, "
          "is not determined by these recordings. docs/use/identify.md has the equations.",
      .tables = {
          numbered(report_table(drive_parameter_table(identified)), identified.parameters.size())}};
  for (const bool of_positive : {true, false}) {
    XyFigure figure = intervals_figure(identified, of_positive);
    if (!figure.series.empty()) section.figures.emplace_back(std::move(figure));
  }
  if (!has_standard_errors(identified))
    section.text +=
        " There are no standard errors here, and so no intervals: it is not known which "
        "parameters are determined.";
  return section;
}

ReportSection structures_section(const DriveIdentification& identified) {
  ReportTable table{.headings = {"change", "terms beyond the base", "held-out error [rad]",
                                 "standard error of its difference [rad]", "taken"},
                    .rows = {}};
  for (const StructureTrial& trial : identified.trials)
    table.rows.push_back(
        {{trial.change, terms_text(trial.terms), fmt::format("{:.5f}", trial.mae_rad),
          std::isfinite(trial.gain_error_rad) ? fmt::format("{:.5f}", trial.gain_error_rad) : "-",
          trial.is_taken ? "yes" : "no"}});
  return {.heading = "Structures that were compared",
          .text =
              "The error of recordings that were left out of the fit; docs/use/identify.md has "
              "the rule of the choice. That error is too good for the structure that it chose; "
              "the nested one is not.",
          .tables = {std::move(table)}};
}

std::vector<std::string> summary_of(const DriveIdentification& identified) {
  std::vector<std::string> summary{
      fmt::format("In free runs from the command alone the angle is wrong by {:.4f} rad (mean of "
                  "|error|) in {} recordings that were {}.",
                  identified.mae_rad, identified.recordings.size(),
                  is_evaluated(identified) ? "not fitted here" : "fitted")};
  if (std::isfinite(identified.held_out_mae_rad))
    summary.push_back(fmt::format(
        "In recordings that were left out of the fit it is wrong by {:.4f} rad ({} groups){}.",
        identified.held_out_mae_rad, identified.groups,
        std::isfinite(identified.nested_mae_rad)
            ? fmt::format("; by {:.4f} rad if the terms are chosen without them, too",
                          identified.nested_mae_rad)
            : ""));
  std::string missing;
  for (const IdentifiedDriveParameter& parameter : identified.parameters)
    if (parameter.is_determined == false)
      missing += fmt::format("{}{}", missing.empty() ? "" : ", ",
                             drive_parameter_info(parameter.parameter).name);
  if (!missing.empty()) summary.push_back("Not determined: " + missing + ".");
  if (!has_standard_errors(identified))
    summary.emplace_back(
        "Without standard errors it is not known which parameters these recordings determine.");
  return summary;
}

ReportSection errors_section(const DriveIdentification& identified) {
  return {.heading = "Errors of the free runs",
          .text =
              "Mean |measured - simulated angle|. Held out: fitted without the recording's group; "
              "nested: the terms were chosen without it, too.",
          .tables = {numbered(report_table(drive_score_table(identified)),
                              identified.recordings.size())},
          .figures = {errors_figure(identified)},
          .preformatted = is_evaluated(identified) ? drive_evaluation_text(identified)
                                                   : identification_text(identified)};
}

void add_motions(const std::vector<DriveRuns>& runs, ReportDocument& document) {
  constexpr std::size_t kDrawn = 30;
  for (std::size_t k = 0; k < std::min(runs.size(), kDrawn); ++k)
    document.sections.push_back(
        {.heading = runs[k].recording->name(), .figures = {motion_figure(runs[k])}});
  if (runs.size() > kDrawn)
    document.sections.back().text =
        fmt::format("The motions of {} more recordings are not drawn.", runs.size() - kDrawn);
}

void add_origins(const std::vector<Recording>& recordings, ReportDocument& document) {
  for (const Recording& recording : recordings)
    document.origin.emplace_back(
        "recording " + recording.name(),
        recording.source.sha256.empty()
            ? "made in memory"
            : recording.source.file + ", SHA-256 " + recording.source.sha256);
}

}  // namespace

ReportDocument identification_report(const DriveIdentification& identified,
                                     const std::vector<Recording>& recordings,
                                     const std::vector<DriveAdvice>& advice) {
  const std::vector<DriveRuns> runs = runs_of(identified, recordings);
  ReportDocument document{.title = "Drive that was identified from free runs",
                          .summary = summary_of(identified),
                          .sections = {},
                          .origin = {}};
  ReportSection findings = findings_section(identified, advice);
  if (!findings.tables.empty()) document.sections.push_back(std::move(findings));
  document.sections.push_back(errors_section(identified));
  document.sections.push_back(parameters_section(identified));
  document.sections.push_back(
      {.heading = "Friction",
       .text = "The largest torque of the friction in steady motion. The load is L of the "
               "equations, up to the largest one in these recordings: with one mass about twice "
               "the torque of the load, since the motor's torque counts in it, too.",
       .figures = {friction_figure(identified, runs)}});
  if (!identified.trials.empty()) document.sections.push_back(structures_section(identified));
  add_motions(runs, document);
  add_origins(recordings, document);
  return document;
}

}  // namespace torsio
