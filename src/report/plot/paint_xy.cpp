#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "report/plot/figure_painter.hpp"

namespace torsio {
namespace {

void widen(PlotRange& range, double factor) {
  const double middle = 0.5 * (range.lowest + range.highest);
  const double half = 0.5 * factor * (range.highest - range.lowest);
  range = {.lowest = middle - half, .highest = middle + half};
}

/// Widens one of the ranges so that a unit is as long on both axes.
void make_equal(PlotRange& x, PlotRange& y, const PlotArea& frame) {
  const double per_point_x = (x.highest - x.lowest) / frame.width;
  const double per_point_y = (y.highest - y.lowest) / frame.height;
  if (!(per_point_x > 0.0) || !(per_point_y > 0.0)) return;
  if (per_point_x < per_point_y) widen(x, per_point_y / per_point_x);
  if (per_point_y < per_point_x) widen(y, per_point_x / per_point_y);
}

}  // namespace

void FigurePainter::points(const XySeries& series, const PlotAxis& x, const PlotAxis& y) {
  const double cell = std::max(0.5 / detail_, 0.5);
  const double radius = series.x.size() < 50 ? 1.6 : 0.6;
  std::set<std::pair<long, long>> taken;
  cairo_set_dash(cairo_, nullptr, 0, 0.0);
  cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
  cairo_set_line_width(cairo_, 2.0 * radius);
  for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
    const double at_x = x.at(series.x[i]);
    const double at_y = y.at(series.y[i]);
    if (!std::isfinite(at_x) || !std::isfinite(at_y)) continue;
    if (!taken.emplace(std::lround(at_x / cell), std::lround(at_y / cell)).second) continue;
    cairo_move_to(cairo_, rounded_position(at_x), rounded_position(at_y));
    cairo_close_path(cairo_);
  }
  cairo_stroke(cairo_);
  cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_BUTT);
}

void FigurePainter::point_names(const XyFigure& figure, const PlotAxis& x, const PlotAxis& y,
                                const PlotArea& frame) {
  constexpr std::size_t kMaxAvoided = 500;  // points of a line that names keep away from
  constexpr double kHeight = 8.0;
  std::vector<PlotPoint> points;
  std::vector<std::string> names;
  std::vector<std::pair<PlotPoint, PlotPoint>> lines;
  for (const XySeries& series : figure.series) {
    if (!series.is_shown) continue;
    const std::size_t count = std::min(series.x.size(), series.y.size());
    const auto at = [&](std::size_t i) { return PlotPoint{x.at(series.x[i]), y.at(series.y[i])}; };
    if (series.style == CurveStyle::line && count <= kMaxAvoided)
      for (std::size_t i = 1; i < count; ++i) lines.emplace_back(at(i - 1), at(i));
    if (series.style != CurveStyle::points) continue;
    for (std::size_t i = 0; i < std::min(series.names.size(), count); ++i) {
      const PlotPoint point = at(i);
      if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
      points.push_back(point);
      names.push_back(series.names[i]);
    }
  }
  std::vector<LabelSize> sizes;
  sizes.reserve(names.size());
  for (const std::string& point_name : names)
    sizes.push_back({.width = text_width(point_name), .height = kHeight});
  const auto places = place_labels(points, sizes, frame, lines);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!places[i]) continue;
    const PlotArea& box = places[i]->box;
    if (places[i]->is_far) {
      cairo_set_source_rgb(cairo_, 0.6, 0.6, 0.6);
      cairo_set_dash(cairo_, nullptr, 0, 0.0);
      cairo_set_line_width(cairo_, 0.3);
      cairo_move_to(cairo_, points[i].x, points[i].y);
      cairo_line_to(cairo_, std::clamp(points[i].x, box.left, box.left + box.width),
                    std::clamp(points[i].y, box.top + 1.0, box.top + box.height - 1.0));
      cairo_stroke(cairo_);
    }
    text(names[i], box.left, box.top + kHeight - 2.0, Align::begin);
  }
}

std::size_t FigurePainter::name_rows(const XySeries* series, double width) const {
  if (series == nullptr || series->names.empty()) return 0;
  double widest = 0.0;
  for (const std::string& column : series->names) widest = std::max(widest, text_width(column));
  const double step = width / static_cast<double>(series->names.size());
  const auto rows = static_cast<std::size_t>(std::ceil((widest + 4.0) / step));
  return std::clamp<std::size_t>(rows, 1, series->names.size());
}

void FigurePainter::column_names(const XySeries& series, const PlotAxis& x, const PlotArea& frame,
                                 std::size_t rows) {
  for (std::size_t i = 0; i < std::min(series.names.size(), series.x.size()); ++i) {
    const double half = 0.5 * text_width(series.names[i]);
    const double right = frame.left + frame.width + 5.0 - half;
    const double at = std::max(std::min(x.at(series.x[i]), right), half + 2.0);
    text(series.names[i], at,
         frame.top + frame.height + PlotLengths::kText + 2.0 +
             PlotLengths::kLineHeight * static_cast<double>(i % rows),
         Align::middle);
  }
}

void FigurePainter::columns(const XySeries& series, const PlotAxis& x, const PlotAxis& y) {
  double width = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < series.x.size(); ++i)
    width = std::min(width, std::abs(x.at(series.x[i]) - x.at(series.x[i - 1])));
  width = std::isfinite(width) ? 0.85 * width : 12.0;
  const double zero = y.at(0.0);
  for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
    const double at_x = x.at(series.x[i]);
    const double at_y = y.at(series.y[i]);
    if (!std::isfinite(at_x) || !std::isfinite(at_y) || !std::isfinite(zero)) continue;
    cairo_rectangle(cairo_, at_x - 0.5 * width, std::min(at_y, zero), width, std::abs(zero - at_y));
  }
  cairo_fill(cairo_);
}

void FigurePainter::draw(const XyFigure& figure, const PlotArea& area) {
  PlotRange x_range;
  PlotRange y_range;
  std::vector<LegendEntry> entries;
  const XySeries* named = nullptr;  // whose columns have names
  std::size_t models = 0;
  for (const XySeries& series : figure.series) {
    const std::size_t index = series.role == CurveRole::model ? models++ : 0;
    if (!series.is_shown) continue;
    entries.push_back({series.label, series.role, index, series.style});
    if (series.style == CurveStyle::columns) {
      named = series.names.empty() ? named : &series;
      y_range.include(0.0);
      if (const std::size_t count = series.x.size(); count > 0) {
        const double half = count > 1 ? 0.5 * std::abs(series.x[1] - series.x[0]) : 0.5;
        x_range.include(series.x.front() - half);
        x_range.include(series.x.back() + half);
      }
    }
    for (std::size_t i = 0; i < std::min(series.x.size(), series.y.size()); ++i) {
      const double x = series.x[i];
      const double y = series.y[i];
      if (!std::isfinite(x) || !std::isfinite(y) || (figure.x.is_logarithmic && x <= 0.0) ||
          (figure.y.is_logarithmic && y <= 0.0))
        continue;
      x_range.include(x);
      y_range.include(y);
    }
  }
  const double head_height = head(figure.title, entries, area);
  PlotArea frame{.left = area.left,
                 .top = area.top + head_height,
                 .width = area.width,
                 .height = area.height - head_height - PlotLengths::kBottom};
  const std::size_t rows = name_rows(named, 0.9 * area.width);
  if (rows > 1) frame.height -= PlotLengths::kLineHeight * static_cast<double>(rows - 1);
  frame.left += left_margin(
      PlotAxis(y_range, figure.y.is_logarithmic, true, frame.top + frame.height, frame.top));
  frame.width = area.left + area.width - 6.0 - frame.left;
  if (figure.is_equal) make_equal(x_range, y_range, frame);
  const PlotAxis y(y_range, figure.y.is_logarithmic, true, frame.top + frame.height, frame.top);
  const PlotAxis x(x_range, figure.x.is_logarithmic, true, frame.left, frame.left + frame.width);
  clip(frame);
  std::size_t shown = 0;
  for (const XySeries& series : figure.series) {
    if (!series.is_shown) continue;
    const LegendEntry& entry = entries[shown++];
    use_pen(entry.role, entry.index);
    if (series.style == CurveStyle::points) points(series, x, y);
    if (series.style == CurveStyle::columns) columns(series, x, y);
    if (series.style != CurveStyle::line) continue;
    line(series.x, series.y, x, y);
    cairo_stroke(cairo_);
  }
  cairo_restore(cairo_);
  ReportAxis numbered = figure.x;
  if (named != nullptr) numbered.label.clear();
  axes(x, y, numbered, figure.y, frame);
  if (named != nullptr) column_names(*named, x, frame, rows);
  point_names(figure, x, y, frame);
}

}  // namespace torsio
