#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "report/plot/figure_painter.hpp"

namespace torsio {
namespace {

constexpr std::size_t kShades = 32;

/// The shade of a value, `kShades` for one that is not finite; the lowest for all where none is above 0.
std::size_t shade_of(const FieldFigure& figure, double value) {
  if (!std::isfinite(value)) return kShades;
  if (!(figure.highest > 0.0)) return 0;
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

}  // namespace

double FigurePainter::colour_scale(const FieldFigure& figure, double left, double top) {
  constexpr double kWidth = 2.0 * kShades;
  for (std::size_t shade = 0; shade < kShades; ++shade) {
    const auto [red, green, blue] = shade_colour(shade);
    cairo_set_source_rgb(cairo_, red, green, blue);
    cairo_rectangle(cairo_, left + 8.0 + 2.0 * static_cast<double>(shade), top, 2.0,
                    PlotLengths::kText);
    cairo_fill(cairo_);
  }
  text("0", left, top + PlotLengths::kText - 1.0, Align::begin);
  text(fmt::format("{:.3g} {}", figure.highest, figure.value_label), left + 8.0 + kWidth + 4.0,
       top + PlotLengths::kText - 1.0, Align::begin);
  return PlotLengths::kLineHeight + 4.0;
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
        cairo_line_to(cairo_, rounded_position(left + scale * (at_x - x.lowest)),
                      rounded_position(bottom - scale * (at_y - y.lowest)));
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
