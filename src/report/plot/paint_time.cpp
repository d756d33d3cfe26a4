#include <algorithm>
#include <cmath>
#include <utility>

#include "report/document/decimation.hpp"
#include "report/plot/figure_painter.hpp"

namespace torsio {
namespace {

constexpr double kStep = 0.25;  ///< between minimum and maximum of a time series

/// Without the name of the bound, which has the colour of its model.
std::string curve_of(const TimeSeries& series) {
  for (const std::string_view bound : {" lower bound", " upper bound"})
    if (series.label.ends_with(bound))
      return series.label.substr(0, series.label.size() - bound.size());
  return series.label;
}

bool is_bound(CurveRole role) { return role == CurveRole::lower || role == CurveRole::upper; }

/// Minima and maxima of at most `count` steps of a series.
std::vector<double> reduced(const std::vector<float>& overview, std::size_t count) {
  std::vector<double> values(overview.begin(), overview.end());
  if (values.size() <= 2 * count) return values;
  const std::vector<float> kept = overview_of(values, values.size() / count + 1);
  return {kept.begin(), kept.end()};
}

std::vector<double> times_of(const TimeFigure& figure, std::size_t count) {
  std::vector<double> time_s(count);
  const double duration_s = static_cast<double>(figure.samples) / figure.rate_Hz;
  for (std::size_t i = 0; i < count; ++i)
    time_s[i] =
        figure.start_s + (static_cast<double>(i) + 0.5) / static_cast<double>(count) * duration_s;
  return time_s;
}

}  // namespace

std::vector<const TimeFigure::Panel*> shown_panels(const TimeFigure& figure) {
  std::vector<const TimeFigure::Panel*> panels;
  for (const TimeFigure::Panel& panel : figure.panels)
    if (std::ranges::any_of(panel.series, &TimeSeries::is_shown)) panels.push_back(&panel);
  return panels;
}

void FigurePainter::value_names(const TimeFigure::Panel& panel,
                                const std::vector<std::vector<double>>& values, const PlotAxis& y,
                                const PlotArea& frame) {
  for (std::size_t k = 0; k < panel.value_names.size(); ++k) {
    const auto number = static_cast<double>(k);
    const bool occurs = std::ranges::any_of(values, [&](const std::vector<double>& series) {
      return std::ranges::find(series, number) != series.end();
    });
    if (occurs) text(panel.value_names[k], frame.left + 4.0, y.at(number) - 1.5, Align::begin);
  }
}

void FigurePainter::panel(const TimeFigure& figure, const TimeFigure::Panel& panel,
                          const std::vector<LegendEntry>& entries, const PlotAxis& x,
                          const PlotArea& frame, bool is_last) {
  const auto count =
      static_cast<std::size_t>(std::max(std::round(frame.width / (2.0 * kStep) * detail_), 16.0));
  PlotRange range;
  std::vector<std::vector<double>> values;
  values.reserve(panel.series.size());
  for (const TimeSeries& series : panel.series) {
    values.push_back(series.is_shown ? reduced(series.overview, count) : std::vector<double>());
    for (const double value : values.back())
      if (std::isfinite(value)) range.include(value);
  }
  if (!panel.value_names.empty() && !range.is_empty()) {
    const double margin = 0.35 * std::max(range.highest - range.lowest, 1.0);
    range.include(range.lowest - margin);
    range.include(range.highest + margin);
  }
  const PlotAxis y(range, false, true, frame.top + frame.height, frame.top);
  clip(frame);
  cairo_set_source_rgb(cairo_, 1.0, 0.88, 0.70);
  for (const TimeMark& mark : figure.marks) {
    const double begin = x.at(mark.begin_s);
    cairo_rectangle(cairo_, begin, frame.top, std::max(x.at(mark.end_s) - begin, 0.5),
                    frame.height);
  }
  cairo_fill(cairo_);
  for (std::size_t s = 0; s < panel.series.size(); ++s) {
    const TimeSeries& series = panel.series[s];
    if (!series.is_shown) continue;
    const auto entry = std::ranges::find(entries, curve_of(series), &LegendEntry::label);
    use_pen(is_bound(series.role) ? CurveRole::model : series.role,
            entry == entries.end() ? 0 : entry->index);
    if (is_bound(series.role)) {
      cairo_set_dash(cairo_, nullptr, 0, 0.0);
      cairo_set_line_width(cairo_, 0.3);
    }
    line(times_of(figure, values[s].size()), values[s], x, y);
    cairo_stroke(cairo_);
  }
  cairo_restore(cairo_);
  axes(x, y, {is_last ? "time [s]" : ""}, {panel.label}, frame);
  if (!panel.value_names.empty()) value_names(panel, values, y, frame);
}

void FigurePainter::draw(const TimeFigure& figure, const PlotArea& area) {
  const std::vector<const TimeFigure::Panel*> panels = shown_panels(figure);
  std::vector<LegendEntry> entries;
  std::size_t models = 0;
  for (const TimeFigure::Panel* panel : panels)
    for (const TimeSeries& series : panel->series) {
      if (!series.is_shown || is_bound(series.role) ||
          std::ranges::find(entries, series.label, &LegendEntry::label) != entries.end())
        continue;
      entries.push_back(
          {series.label, series.role, series.role == CurveRole::model ? models++ : 0});
    }
  const double head_height = head(figure.title, entries, area);
  constexpr double kLeft = 46.0;
  constexpr double kBetween = 5.0;
  const double left = area.left + kLeft;
  const double width = area.width - kLeft - 6.0;
  const PlotAxis x(
      {figure.start_s, figure.start_s + static_cast<double>(figure.samples) / figure.rate_Hz},
      false, false, left, left + width);
  const double height =
      (area.height - head_height - PlotLengths::kBottom) / static_cast<double>(panels.size());
  double top = area.top + head_height;
  for (const TimeFigure::Panel* one : panels) {
    panel(figure, *one, entries, x, {left, top, width, height - kBetween}, one == panels.back());
    top += height;
  }
}

}  // namespace torsio
