#include "report/html/model_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/html/model_run.hpp"
#include "report/html/residual_figures.hpp"
#include "report/html/speed_loops.hpp"
#include "report/html/time_figure_builder.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"
#include "torsio/fit/common/load_target.hpp"

namespace torsio {
namespace {

constexpr std::size_t kShownModels = 3;
constexpr std::size_t kRecordings = 4;

Role reported_role(const Dataset& dataset) {
  for (const Role role : {Role::test, Role::validation})
    if (dataset.has_role(role)) return role;
  return Role::train;
}

XySeries curve(std::string label, CurveRole role, bool is_shown, const std::vector<double>& x,
               const std::vector<double>& y) {
  ThinnedCurve thin = thinned(x, y);
  return {.label = std::move(label),
          .role = role,
          .is_shown = is_shown,
          .x = std::move(thin.x),
          .y = std::move(thin.y)};
}

XyFigure loops(const RecordRuns& record) {
  XyFigure figure{.title = fmt::format("{} over {}", record.target->name, record.input_name),
                  .x = {with_unit(record.input_name)},
                  .y = {with_unit(record.target->name)},
                  .series = {}};
  const std::vector<double>& x = record.input;
  figure.series.push_back(curve("measured", CurveRole::measured, true, x, record.target->values));
  for (std::size_t m = 0; m < record.runs.size(); ++m)
    figure.series.push_back(
        curve(record.runs[m].label, CurveRole::model, m < kShownModels, x, record.runs[m].value));
  return figure;
}

/// The measured loop with colours by time and by speed.
XyFigure coloured_loop(const RecordRuns& record) {
  ThinnedCurve thin = thinned(record.input, record.target->values);
  XySeries by_time{.label = "measured", .x = std::move(thin.x), .y = std::move(thin.y)};
  for (const std::size_t n : thin.kept) by_time.colour.push_back(record.recording->time_s(n));
  return {.title = "The measured loop, coloured by time",
          .x = {with_unit(record.input_name)},
          .y = {with_unit(record.target->name)},
          .series = {std::move(by_time)},
          .colour_label = "time, from dark at the start to light at the end"};
}

/// Where the first model errs most.
std::vector<PlaceOfInterest> largest_residuals(const RecordRuns& record) {
  constexpr std::size_t kWanted = 12;
  const std::vector<double>& residual = record.runs.front().residual;
  // The largest of each of many sections: neighbours of one peak are one place.
  const std::size_t section = std::max<std::size_t>(residual.size() / 200, 1);
  std::vector<std::size_t> peaks;
  for (std::size_t begin = 0; begin < residual.size(); begin += section) {
    std::size_t peak = residual.size();
    for (std::size_t n = begin; n < std::min(begin + section, residual.size()); ++n)
      if (std::isfinite(residual[n]) &&
          (peak == residual.size() || std::abs(residual[n]) > std::abs(residual[peak])))
        peak = n;
    if (peak < residual.size()) peaks.push_back(peak);
  }
  std::ranges::sort(peaks, std::greater<>{}, [&](std::size_t n) { return std::abs(residual[n]); });
  peaks.resize(std::min(peaks.size(), kWanted));
  std::vector<PlaceOfInterest> places;
  places.reserve(peaks.size());
  for (const std::size_t n : peaks)
    places.push_back(
        {n, fmt::format("error {:.3g} at {:.2f} s", residual[n], record.recording->time_s(n))});
  return places;
}

TimeFigure time_series(const RecordRuns& record, std::size_t max_values) {
  std::vector<PlaceOfInterest> places = reversals_of(record.input);
  std::ranges::copy(largest_residuals(record), std::back_inserter(places));
  const std::size_t series = 2 + record.recording->channels().size() + 2 * record.runs.size();
  TimeFigureBuilder builder("Time series of " + record.recording->name(), *record.recording, series,
                            places, max_values);
  builder.panel(with_unit(record.target->name));
  builder.add("measured", CurveRole::measured, true, record.target->values);
  const ModelRun& first = record.runs.front();
  std::vector<double> lower(first.value.size());
  std::vector<double> upper(first.value.size());
  for (std::size_t n = 0; n < lower.size(); ++n) {
    lower[n] = first.value[n] - 2.0 * first.std_dev[n];
    upper[n] = first.value[n] + 2.0 * first.std_dev[n];
  }
  builder.add(first.label + " lower bound", CurveRole::lower, true, lower);
  builder.add(first.label + " upper bound", CurveRole::upper, true, upper);
  for (std::size_t m = 0; m < record.runs.size(); ++m)
    builder.add(record.runs[m].label, CurveRole::model, m < kShownModels, record.runs[m].value);
  builder.panel(fmt::format("error [{}]", unit_label(record.target->name)));
  for (std::size_t m = 0; m < record.runs.size(); ++m)
    builder.add(record.runs[m].label, CurveRole::model, m < kShownModels, record.runs[m].residual);
  builder.add_channels(*record.recording, {record.target->name});
  builder.mark(first.guarded, "guard or fault of " + first.label);
  return builder.finish();
}

}  // namespace

std::vector<ReportSection> model_sections(const Dataset& dataset,
                                          const std::vector<ReportedModel>& models,
                                          const Progress& progress) {
  const Role role = reported_role(dataset);
  std::vector<const DatasetRecord*> records;
  for (const DatasetRecord& record : dataset.records)
    if (record.has_role(role)) records.push_back(&record);
  const std::size_t shown = std::min(records.size(), kRecordings);
  std::vector<ReportSection> sections;
  for (std::size_t r = 0; r < shown; ++r) {
    if (progress && !progress(static_cast<double>(r) / static_cast<double>(shown), "report"))
      throw Cancelled();
    const RecordRuns runs = run_models(dataset, *records[r], models, role);
    ReportSection section{
        .heading = fmt::format("{} ({})", runs.recording->name(), name(role)),
        .text = fmt::format("{} samples at {:g} Hz. The error band is two standard deviations.",
                            runs.recording->size(), runs.recording->sample_rate_Hz())};
    if (r == 0 && records.size() > shown)
      section.text +=
          fmt::format(" The first {} of {} recordings are shown.", shown, records.size());
    for (const std::string& failure : runs.failures) section.text += " " + failure;
    if (!runs.runs.empty()) {
      section.figures.emplace_back(loops(runs));
      section.figures.emplace_back(
          time_series(runs, values_of_figure(runs.recording->size()) / shown));
      section.figures.emplace_back(coloured_loop(runs));
      section.figures.emplace_back(speed_loops(runs.input_name, runs.input, runs.target->name,
                                               runs.target->values,
                                               runs.recording->sample_rate_Hz()));
      std::ranges::move(residual_figures(runs), std::back_inserter(section.figures));
    }
    sections.push_back(std::move(section));
  }
  return sections;
}

ReportSection card_section(const ModelFile& file, const std::string& title) {
  ReportTable table{.headings = {"entry", "value"}, .rows = {}, .is_words = true};
  const auto add = [&](std::string entry, std::string value) {
    if (!value.empty()) table.rows.push_back({{std::move(entry), std::move(value)}});
  };
  const ModelCard& card = file.card;
  add("family", card.fitted_as);
  add("target", file.settings.target);
  add("inputs", fmt::format("{}", fmt::join(file.settings.features.inputs, ", ")));
  add("sample rate", fmt::format("{:g} Hz", file.settings.sample_rate_Hz));
  for (const auto& [option, value] : card.options) add("option " + option, value);
  add("seed", fmt::format("{}", card.seed));
  for (const Source& source : card.training_files)
    add("trained on", fmt::format("{}, SHA-256 {}", source.file, source.sha256));
  if (card.load_target.is_used())
    add("known load", fmt::format("{}", fmt::join(load_target_notes(card.load_target), "; ")));
  add("reference sensor", uncertainty_text(file.settings.target_uncertainty, file.settings.target));
  add("scored on", card.held_out);
  for (const auto& [metric, value] : card.metrics) add(metric, fmt::format("{:.4g}", value));
  add("device", card.device_serial);
  add("written by", card.torsio_version);
  return {.heading = title, .tables = {std::move(table)}};
}

std::vector<std::pair<std::string, std::string>> origin_of(const Dataset& dataset) {
  std::vector<std::pair<std::string, std::string>> origin;
  for (const DatasetRecord& record : dataset.records) {
    const Source& source = record.recording.source;
    origin.emplace_back(
        "recording " + record.recording.name(),
        source.sha256.empty() ? "made in memory" : source.file + ", SHA-256 " + source.sha256);
  }
  return origin;
}

}  // namespace torsio
