#include "report/plot/figure_painter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <utility>

#include "data/names.hpp"
#include "report/document/decimation.hpp"
#include "report/plot/simplified_line.hpp"

namespace torsio {
namespace {

constexpr double kText = 7.0;
constexpr double kLineHeight = 9.5;
constexpr double kTickLength = 2.5;
constexpr double kBottom = 24.0;  ///< for the numbers and the label of the horizontal axis
constexpr double kStep = 0.25;    ///< between minimum and maximum of a time series
/// Largest distance of a drawn line from its points: less than half a dot of 300 to the inch.
constexpr double kDeviation = 0.1;
constexpr double kMaxPoints = 8000.0;  ///< in a line

/// Cairo writes a coordinate of SVG with up to six digits; of a sixteenth these are at most four.
double rounded(double position) { return std::round(16.0 * position) / 16.0; }

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

constexpr std::size_t kShades = 32;

/// The shade of a value, `kShades` for one that is not finite.
std::size_t shade_of(const FieldFigure& figure, double value) {
  if (!std::isfinite(value)) return kShades;
  const double share = std::clamp(value / figure.highest, 0.0, 1.0);
  return std::min(static_cast<std::size_t>(share * kShades), kShades - 1);
}

/// Blue over green to red.
std::array<double, 3> shade_colour(std::size_t shade) {
  if (shade >= kShades) return {1.0, 1.0, 1.0};
  const double hue =
      4.0 * (1.0 - (static_cast<double>(shade) + 0.5) / kShades);  // in sixths of a circle
  const auto channel = [&](double peak) {
    const double distance = std::abs(std::remainder(hue - peak, 6.0));
    return 0.1 + 0.8 * std::clamp(2.0 - distance, 0.0, 1.0);
  };
  return {channel(0.0), channel(2.0), channel(4.0)};
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

FigurePainter::Colour FigurePainter::colour_of(CurveRole role, std::size_t index) {
  // Okabe and Ito (2008), without the yellow, which cannot be seen on white.
  static constexpr std::array<Colour, 6> kColours = {{{0.0, 0.447, 0.698},
                                                      {0.835, 0.369, 0.0},
                                                      {0.0, 0.620, 0.451},
                                                      {0.800, 0.475, 0.655},
                                                      {0.902, 0.624, 0.0},
                                                      {0.337, 0.706, 0.914}}};
  if (role == CurveRole::measured) return {0.25, 0.25, 0.25};
  if (role == CurveRole::limit) return {0.45, 0.45, 0.45};
  return kColours[index % kColours.size()];
}

void FigurePainter::use_pen(CurveRole role, std::size_t index) {
  static constexpr std::array<double, 2> kLong = {5.0, 2.0};
  static constexpr std::array<double, 2> kShort = {1.5, 1.5};
  static constexpr std::array<double, 4> kMixed = {5.0, 1.5, 1.5, 1.5};
  const Colour colour = colour_of(role, index);
  cairo_set_source_rgb(cairo_, colour.red, colour.green, colour.blue);
  cairo_set_line_width(cairo_, role == CurveRole::measured ? 1.1 : 0.8);
  cairo_set_line_join(cairo_, CAIRO_LINE_JOIN_ROUND);
  cairo_set_dash(cairo_, nullptr, 0, 0.0);
  if (role == CurveRole::limit || (role == CurveRole::model && index % 4 == 2))
    cairo_set_dash(cairo_, kShort.data(), static_cast<int>(kShort.size()), 0.0);
  else if (role == CurveRole::model && index % 4 == 1)
    cairo_set_dash(cairo_, kLong.data(), static_cast<int>(kLong.size()), 0.0);
  else if (role == CurveRole::model && index % 4 == 3)
    cairo_set_dash(cairo_, kMixed.data(), static_cast<int>(kMixed.size()), 0.0);
}

double FigurePainter::text_width(const std::string& text) const {
  cairo_text_extents_t extents{};
  cairo_text_extents(cairo_, escaped(text).c_str(), &extents);
  return extents.x_advance;
}

void FigurePainter::text(const std::string& text, double x, double y, Align align,
                         bool is_upright) {
  if (text.empty()) return;
  const double share = align == Align::begin ? 0.0 : align == Align::middle ? 0.5 : 1.0;
  std::string drawn = escaped(text);  // cairo fails on what is not UTF-8
  cairo_save(cairo_);
  cairo_set_source_rgb(cairo_, 0.0, 0.0, 0.0);
  cairo_translate(cairo_, x, y);
  if (is_upright) cairo_rotate(cairo_, -0.5 * std::numbers::pi);
  cairo_move_to(cairo_, -share * text_width(drawn), 0.0);
  cairo_show_text(cairo_, drawn.c_str());
  cairo_restore(cairo_);
  cairo_new_path(cairo_);
  texts_.push_back(std::move(drawn));
}

double FigurePainter::head(const std::string& title, const std::vector<LegendEntry>& entries,
                           const PlotArea& area) {
  double y = area.top + kLineHeight;
  text(title, area.left + 2.0, y, Align::begin);
  double height = kLineHeight + 4.0;
  if (entries.size() < 2) return height;
  constexpr double kSample = 14.0;
  double x = area.left + 2.0;
  y += kLineHeight;
  height += kLineHeight;
  for (const LegendEntry& entry : entries) {
    const double width = kSample + 3.0 + text_width(entry.label) + 8.0;
    if (x > area.left + 2.0 && x + width > area.left + area.width) {
      x = area.left + 2.0;
      y += kLineHeight;
      height += kLineHeight;
    }
    use_pen(entry.role, entry.index);
    cairo_move_to(cairo_, x, y - 2.5);
    cairo_line_to(cairo_, x + kSample, y - 2.5);
    cairo_stroke(cairo_);
    text(entry.label, x + kSample + 3.0, y, Align::begin);
    x += width;
  }
  return height;
}

double FigurePainter::left_margin(const PlotAxis& y) const {
  double widest = 0.0;
  for (const PlotAxis::Tick& tick : y.ticks()) widest = std::max(widest, text_width(tick.text));
  return widest + kTickLength + 2.0 + kLineHeight + 3.0;
}

void FigurePainter::axes(const PlotAxis& x, const PlotAxis& y, const ReportAxis& x_axis,
                         const ReportAxis& y_axis, const PlotArea& frame) {
  const double bottom = frame.top + frame.height;
  cairo_set_dash(cairo_, nullptr, 0, 0.0);
  cairo_set_line_width(cairo_, 0.5);
  cairo_set_source_rgb(cairo_, 0.0, 0.0, 0.0);
  cairo_rectangle(cairo_, frame.left, frame.top, frame.width, frame.height);
  for (const PlotAxis::Tick& tick : x.ticks()) {
    cairo_move_to(cairo_, x.at(tick.value), bottom);
    cairo_rel_line_to(cairo_, 0.0, -kTickLength);
  }
  for (const PlotAxis::Tick& tick : y.ticks()) {
    cairo_move_to(cairo_, frame.left, y.at(tick.value));
    cairo_rel_line_to(cairo_, kTickLength, 0.0);
  }
  cairo_stroke(cairo_);
  double free_from = -1e9;
  double widest = 0.0;
  for (const PlotAxis::Tick& tick : y.ticks()) {
    widest = std::max(widest, text_width(tick.text));
    text(tick.text, frame.left - 2.0, y.at(tick.value) + 2.5, Align::end);
  }
  if (!x_axis.label.empty()) {
    for (const PlotAxis::Tick& tick : x.ticks()) {
      const double half = 0.5 * text_width(tick.text);
      if (x.at(tick.value) - half < free_from) continue;
      text(tick.text, x.at(tick.value), bottom + kText + 2.0, Align::middle);
      free_from = x.at(tick.value) + half + 3.0;
    }
    text(x_axis.label, frame.left + 0.5 * frame.width, bottom + kText + kLineHeight + 3.0,
         Align::middle);
  }
  text(y_axis.label, frame.left - widest - 6.0, frame.top + 0.5 * frame.height, Align::middle,
       true);
}

void FigurePainter::clip(const PlotArea& frame) {
  cairo_save(cairo_);
  cairo_rectangle(cairo_, frame.left, frame.top, frame.width, frame.height);
  cairo_clip(cairo_);
}

void FigurePainter::line(const std::vector<double>& x, const std::vector<double>& y,
                         const PlotAxis& x_axis, const PlotAxis& y_axis) {
  const std::size_t count = std::min(x.size(), y.size());
  const auto most = static_cast<std::size_t>(kMaxPoints * detail_);
  const std::size_t stride = (count + most - 1) / most;
  std::vector<PlotPoint> part;
  const auto finish = [&] {
    if (part.empty()) return;
    const std::vector<PlotPoint> kept = simplified(part, kDeviation / detail_);
    cairo_move_to(cairo_, rounded(kept.front().x), rounded(kept.front().y));
    for (const PlotPoint& point : kept) cairo_line_to(cairo_, rounded(point.x), rounded(point.y));
    part.clear();
  };
  for (std::size_t i = 0; i < count; i += std::max<std::size_t>(stride, 1)) {
    const PlotPoint point{x_axis.at(x[i]), y_axis.at(y[i])};
    if (std::isfinite(point.x) && std::isfinite(point.y))
      part.push_back(point);
    else
      finish();
  }
  finish();
}

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
    cairo_move_to(cairo_, rounded(at_x), rounded(at_y));
    cairo_close_path(cairo_);
  }
  cairo_stroke(cairo_);
  cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_BUTT);
  for (std::size_t i = 0; i < std::min(series.names.size(), series.x.size()); ++i) {
    const double at_x = x.at(series.x[i]);
    const double at_y = y.at(series.y[i]);
    if (std::isfinite(at_x) && std::isfinite(at_y))
      text(series.names[i], at_x + 3.0, at_y - 2.0, Align::begin);
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
  std::size_t models = 0;
  for (const XySeries& series : figure.series) {
    const std::size_t index = series.role == CurveRole::model ? models++ : 0;
    if (!series.is_shown) continue;
    entries.push_back({series.label, series.role, index});
    if (series.style == CurveStyle::columns) y_range.include(0.0);
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
                 .height = area.height - head_height - kBottom};
  const PlotAxis y(y_range, figure.y.is_logarithmic, true, frame.top + frame.height, frame.top);
  frame.left += left_margin(y);
  frame.width = area.left + area.width - 6.0 - frame.left;
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
  axes(x, y, figure.x, figure.y, frame);
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
  const double height = (area.height - head_height - kBottom) / static_cast<double>(panels.size());
  double top = area.top + head_height;
  for (const TimeFigure::Panel* one : panels) {
    panel(figure, *one, entries, x, {left, top, width, height - kBetween}, one == panels.back());
    top += height;
  }
}

double FigurePainter::colour_scale(const FieldFigure& figure, double left, double top) {
  constexpr double kWidth = 2.0 * kShades;
  for (std::size_t shade = 0; shade < kShades; ++shade) {
    const auto [red, green, blue] = shade_colour(shade);
    cairo_set_source_rgb(cairo_, red, green, blue);
    cairo_rectangle(cairo_, left + 8.0 + 2.0 * static_cast<double>(shade), top, 2.0, kText);
    cairo_fill(cairo_);
  }
  text("0", left, top + kText - 1.0, Align::begin);
  text(fmt::format("{:.3g} {}", figure.highest, figure.value_label), left + 8.0 + kWidth + 4.0,
       top + kText - 1.0, Align::begin);
  return kLineHeight + 4.0;
}

void FigurePainter::draw(const FieldFigure& figure, const PlotArea& area) {
  PlotRange x;
  PlotRange y;
  for (const FieldFigure::Area& part : figure.areas)
    for (const auto& [at_x, at_y] : part.corners) {
      x.include(at_x);
      y.include(at_y);
    }
  double head_height = head(figure.title, {}, area);
  head_height += colour_scale(figure, area.left + 2.0, area.top + head_height);
  if (figure.areas.empty()) return;
  const double width = area.width - 8.0;
  const double height = area.height - head_height - 6.0;
  const double scale = std::min(width / (x.highest - x.lowest), height / (y.highest - y.lowest));
  const double left = area.left + 4.0 + 0.5 * (width - scale * (x.highest - x.lowest));
  const double bottom = area.top + head_height + 0.5 * (height + scale * (y.highest - y.lowest));
  // One path for each shade: the file is smaller than with one for each area. What remains white between areas shows
  // the mesh.
  for (std::size_t shade = 0; shade <= kShades; ++shade) {
    const auto [red, green, blue] = shade_colour(shade);
    cairo_set_source_rgb(cairo_, red, green, blue);
    for (const FieldFigure::Area& part : figure.areas) {
      if (shade_of(figure, part.value) != shade) continue;
      cairo_new_sub_path(cairo_);
      for (const auto& [at_x, at_y] : part.corners)
        cairo_line_to(cairo_, rounded(left + scale * (at_x - x.lowest)),
                      rounded(bottom - scale * (at_y - y.lowest)));
      cairo_close_path(cairo_);
    }
    if (shade == kShades) {  // white areas have an outline
      cairo_set_source_rgb(cairo_, 0.6, 0.6, 0.6);
      cairo_set_dash(cairo_, nullptr, 0, 0.0);
      cairo_set_line_width(cairo_, 0.3);
      cairo_stroke(cairo_);
    } else {
      cairo_fill(cairo_);
    }
  }
}

}  // namespace torsio
