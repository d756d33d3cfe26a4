#pragma once

#include <cairo.h>

#include <string>
#include <vector>

#include "report/plot/plot_axis.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// A part of a picture, in points of 1/72 inch.
struct PlotArea {
  double left = 0.0;
  double top = 0.0;
  double width = 0.0;
  double height = 0.0;
};

/// Draws figures with cairo.
class FigurePainter {
 public:
  /// @param detail 1: a point for each quarter of a typographic point; smaller: fewer
  FigurePainter(cairo_t* cairo, double detail) : cairo_(cairo), detail_(detail) {}

  void draw(const XyFigure& figure, const PlotArea& area);
  void draw(const TimeFigure& figure, const PlotArea& area);
  void draw(const FieldFigure& figure, const PlotArea& area);
  /// All texts that were drawn, in their order.
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }

 private:
  struct Colour {
    double red = 0.0;
    double green = 0.0;
    double blue = 0.0;
  };
  struct LegendEntry {
    std::string label;
    CurveRole role = CurveRole::model;
    std::size_t index = 0;
  };
  enum class Align : std::uint8_t { begin, middle, end };

  [[nodiscard]] static Colour colour_of(CurveRole role, std::size_t index);
  void use_pen(CurveRole role, std::size_t index);
  void text(const std::string& text, double x, double y, Align align, bool is_upright = false);
  [[nodiscard]] double text_width(const std::string& text) const;
  /// Title and legend. @returns their height
  double head(const std::string& title, const std::vector<LegendEntry>& entries,
              const PlotArea& area);
  [[nodiscard]] double left_margin(const PlotAxis& y) const;
  void axes(const PlotAxis& x, const PlotAxis& y, const ReportAxis& x_axis,
            const ReportAxis& y_axis, const PlotArea& frame);
  void clip(const PlotArea& frame);
  void line(const std::vector<double>& x, const std::vector<double>& y, const PlotAxis& x_axis,
            const PlotAxis& y_axis);
  void points(const XySeries& series, const PlotAxis& x, const PlotAxis& y);
  void columns(const XySeries& series, const PlotAxis& x, const PlotAxis& y);
  /// Shades from blue to red with the values of both ends. @returns its height
  double colour_scale(const FieldFigure& figure, double left, double top);
  void panel(const TimeFigure& figure, const TimeFigure::Panel& panel,
             const std::vector<LegendEntry>& entries, const PlotAxis& x, const PlotArea& frame,
             bool is_last);

  cairo_t* cairo_;
  double detail_;
  std::vector<std::string> texts_;
};

/// Panels with a curve that is shown.
[[nodiscard]] std::vector<const TimeFigure::Panel*> shown_panels(const TimeFigure& figure);

}  // namespace torsio
