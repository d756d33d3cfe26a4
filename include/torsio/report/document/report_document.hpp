#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace torsio {

/// Rows of text under headings, which the page's reader can sort.
struct ReportTable {
  struct Row {
    std::vector<std::string> cells;  ///< one for each heading
    std::string details = {};        ///< shown when the row is opened; empty: none
  };
  std::string title = {};
  std::vector<std::string> headings;
  std::vector<Row> rows;
  bool is_words = false;  ///< columns of sentences, to the left and wrapped; else of numbers
};

struct ReportAxis {
  std::string label;
  bool is_logarithmic = false;
};

enum class CurveStyle : std::uint8_t { line, points, columns };
enum class CurveRole : std::uint8_t { measured, model, limit, lower, upper };

struct XySeries {
  std::string label;
  CurveStyle style = CurveStyle::line;
  CurveRole role = CurveRole::model;
  bool is_shown = true;
  std::vector<double> x;  ///< a point that is not finite is a gap
  std::vector<double> y;
  std::vector<double> colour = {};  ///< selects the colour of each point (time, speed); empty: one
  std::vector<std::string> names = {};  ///< one for each point, or below each column
};

/// Loops, scatter, columns, histograms, Bode diagrams.
struct XyFigure {
  std::string title;
  ReportAxis x;
  ReportAxis y;
  std::vector<XySeries> series;
  bool is_equal = false;          ///< one unit is as long on both axes
  std::string colour_label = {};  ///< what the colours show
};

/// Samples [begin, end) that a page contains in full.
struct DetailWindow {
  std::size_t begin = 0;
  std::size_t end = 0;
  std::string label;
};

/// A range of time that is shaded: a guard, a fault, a finding.
struct TimeMark {
  double begin_s = 0.0;
  double end_s = 0.0;
  std::string label;
  bool is_failure = false;  ///< else a warning
};

/// One series as a page contains it (`OverviewPlan`).
struct TimeSeries {
  std::string label;
  CurveRole role = CurveRole::measured;
  bool is_shown = true;
  std::vector<float> overview;
  std::vector<float> detail;
};

/// Panels of time series under each other with one range of time. An error band is a series with the
/// role lower and, next to it, one with the role upper.
struct TimeFigure {
  struct Panel {
    std::string label;
    std::vector<TimeSeries> series;
    std::vector<std::string> value_names = {};  ///< names of the values 0, 1, ..: faults, states
  };
  std::string title;
  double start_s = 0.0;
  double rate_Hz = 1.0;
  std::size_t samples = 0;
  std::size_t bucket = 1;  ///< samples in a bucket of the overview
  std::vector<DetailWindow> windows = {};
  std::vector<TimeMark> marks = {};
  std::vector<Panel> panels = {};
};

/// A value over a part of a plane, as the strain over a mesh: areas filled by colours from blue (0) to red.
struct FieldFigure {
  struct Area {
    std::vector<std::array<double, 2>> corners;  ///< around it
    double value = 0.0;                          ///< not finite: white
  };
  std::string title;
  std::string value_label;  ///< what the colours show
  double highest = 1.0;     ///< the value of red
  std::vector<Area> areas;
};

using ReportFigure = std::variant<XyFigure, TimeFigure, FieldFigure>;

struct ReportSection {
  std::string heading;
  std::string text = {};
  std::vector<ReportTable> tables = {};
  std::vector<ReportFigure> figures = {};
  std::string preformatted = {};  ///< text of the terminal, folded
};

/// What a verb reports as a page: its statement first, then tables and figures, then what it was made
/// from.
struct ReportDocument {
  std::string title;
  std::vector<std::string> summary;  ///< sentences
  std::vector<ReportSection> sections;
  /// Command, versions, hashes, seeds.
  std::vector<std::pair<std::string, std::string>> origin;
};

/// The document as one HTML page without external files: a table and a static picture without
/// JavaScript; sorting, zoom and a choice of the curves with it. All text is escaped.
[[nodiscard]] std::string report_html(const ReportDocument& document);

}  // namespace torsio
