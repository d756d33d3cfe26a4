#include "report/plot/figure_painter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "data/names.hpp"
#include "report/plot/simplified_line.hpp"

namespace torsio {
namespace {

constexpr double kTickLength = 2.5;
/// Largest distance of a drawn line from its points: less than half a dot of 300 to the inch.
constexpr double kDeviation = 0.1;
constexpr double kMaxPoints = 8000.0;  ///< in a line

}  // namespace

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
  double y = area.top + PlotLengths::kLineHeight;
  text(title, area.left + 2.0, y, Align::begin);
  double height = PlotLengths::kLineHeight + 4.0;
  if (entries.size() < 2) return height;
  constexpr double kSample = 14.0;
  double x = area.left + 2.0;
  y += PlotLengths::kLineHeight;
  height += PlotLengths::kLineHeight;
  for (const LegendEntry& entry : entries) {
    const double width = kSample + 3.0 + text_width(entry.label) + 8.0;
    if (x > area.left + 2.0 && x + width > area.left + area.width) {
      x = area.left + 2.0;
      y += PlotLengths::kLineHeight;
      height += PlotLengths::kLineHeight;
    }
    use_pen(entry.role, entry.index);
    const bool is_line = entry.style == CurveStyle::line;
    if (!is_line) {
      cairo_set_dash(cairo_, nullptr, 0, 0.0);
      cairo_set_line_width(cairo_, 3.2);
      cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_ROUND);
    }
    const double middle = x + 0.5 * kSample;
    cairo_move_to(cairo_, is_line ? x : middle, y - 2.5);
    cairo_line_to(cairo_, is_line ? x + kSample : middle, y - 2.5);
    cairo_stroke(cairo_);
    cairo_set_line_cap(cairo_, CAIRO_LINE_CAP_BUTT);
    text(entry.label, x + kSample + 3.0, y, Align::begin);
    x += width;
  }
  return height;
}

double FigurePainter::left_margin(const PlotAxis& y) const {
  double widest = 0.0;
  for (const PlotAxis::Tick& tick : y.ticks()) widest = std::max(widest, text_width(tick.text));
  return widest + kTickLength + 2.0 + PlotLengths::kLineHeight + 3.0;
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
      text(tick.text, x.at(tick.value), bottom + PlotLengths::kText + 2.0, Align::middle);
      free_from = x.at(tick.value) + half + 3.0;
    }
    text(x_axis.label, frame.left + 0.5 * frame.width,
         bottom + PlotLengths::kText + PlotLengths::kLineHeight + 3.0, Align::middle);
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
    cairo_move_to(cairo_, rounded_position(kept.front().x), rounded_position(kept.front().y));
    for (const PlotPoint& point : kept)
      cairo_line_to(cairo_, rounded_position(point.x), rounded_position(point.y));
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

}  // namespace torsio
