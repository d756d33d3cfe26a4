#pragma once

#include <cairo.h>

#include <cmath>
#include <string>
#include <vector>

#include "report/plot/label_places.hpp"
#include "report/plot/plot_axis.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// Lengths of a picture, in points.
struct PlotLengths {
  static constexpr double kText = 7.0;
  static constexpr double kLineHeight = 9.5;
  static constexpr double kBottom = 24.0;  ///< for the numbers and the label of the horizontal axis
};

/// Cairo writes a coordinate of SVG with up to six digits; of a sixteenth these are at most four.
[[nodiscard]] inline double rounded_position(double position) {
  return std::round(16.0 * position) / 16.0;
}

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
    CurveStyle style = CurveStyle::line;
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
  void point_names(const XyFigure& figure, const PlotAxis& x, const PlotAxis& y,
                   const PlotArea& frame);
  /// The names below the columns, in rows so that they do not overlap.
  void column_names(const XySeries& series, const PlotAxis& x, const PlotArea& frame,
                    std::size_t rows);
  [[nodiscard]] std::size_t name_rows(const XySeries* series, double width) const;
  void columns(const XySeries& series, const PlotAxis& x, const PlotAxis& y);
  /// Shades from blue to red with the values of both ends. @returns its height
  double colour_scale(const FieldFigure& figure, double left, double top);
  /// Names of faults and states, above their values.
  void value_names(const TimeFigure::Panel& panel, const std::vector<std::vector<double>>& values,
                   const PlotAxis& y, const PlotArea& frame);
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
