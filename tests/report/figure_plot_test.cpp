#include "torsio/report/plot/figure_plot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "support/error_message.hpp"

namespace torsio {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

/// A noisy loop, residuals as points, and a long noisy time series with a gap: far more than a picture can show.
ReportDocument example() {
  constexpr std::size_t kPoints = 60'000;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.1);
  XySeries measured{.label = "measured & <true>", .role = CurveRole::measured, .x = {}, .y = {}};
  XySeries points{.label = "residuals", .style = CurveStyle::points, .x = {}, .y = {}};
  TimeSeries series{.label = "torque_Nm", .overview = {}, .detail = {}};
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double phase = 0.01 * static_cast<double>(i);
    measured.x.push_back(std::sin(phase) + noise(random));
    measured.y.push_back(std::sin(phase + 0.3) + noise(random));
    points.x.push_back(noise(random));
    points.y.push_back(noise(random));
    series.overview.push_back(static_cast<float>(measured.y.back()));
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  measured.x[500] = nan;
  points.y[7] = std::numeric_limits<double>::infinity();
  std::fill_n(series.overview.begin() + 1000, 900, std::numeric_limits<float>::quiet_NaN());
  XySeries hidden = measured;
  hidden.label = "hidden model";
  hidden.is_shown = false;
  TimeFigure time{.title = "Channels over time", .rate_Hz = 100.0, .samples = kPoints / 2};
  time.bucket = 1;
  time.marks.push_back({.begin_s = 1.0, .end_s = 2.0, .label = "gap"});
  time.panels.push_back({.label = "[Nm]", .series = {series}});
  time.panels.push_back({.label = "torque [Nm]", .series = {series, series}});
  ReportDocument document{.title = "example", .summary = {}, .sections = {}, .origin = {}};
  document.sections.push_back({.heading = "figures",
                               .figures = {XyFigure{.title = "Torque over twist",
                                                    .x = {"twist [deg]"},
                                                    .y = {"torque [Nm]"},
                                                    .series = {measured, hidden}},
                                           XyFigure{.title = "Residuals over rate",
                                                    .x = {"rate [deg/s]"},
                                                    .y = {"|error| [Nm]", true},
                                                    .series = {points}},
                                           time}});
  return document;
}

TEST(FigurePlot, IsAFileOfItsFormatOfLimitedSizeAndAlwaysTheSame) {
  const ReportDocument document = example();
  const auto figures = figures_of(document, {"TWIST", "residuals", "time"});
  ASSERT_EQ(figures.size(), 3U);
  const std::string png = figure_plot(figures, PlotFormat::png);
  const std::string pdf = figure_plot(figures, PlotFormat::pdf);
  const std::string svg = figure_plot(figures, PlotFormat::svg);
  EXPECT_THAT(png, StartsWith("\x89PNG\r\n"));
  EXPECT_THAT(pdf, StartsWith("%PDF-1."));
  EXPECT_THAT(svg, StartsWith("<?xml"));
  for (const std::string& bytes : {png, pdf, svg}) {
    EXPECT_GT(bytes.size(), 5'000U);
    EXPECT_LE(bytes.size(), kMaxPlotBytes);
  }
  EXPECT_TRUE(png == figure_plot(figures, PlotFormat::png));
  EXPECT_TRUE(pdf == figure_plot(figures, PlotFormat::pdf));
  EXPECT_TRUE(svg == figure_plot(figures, PlotFormat::svg));
}

TEST(FigurePlot, HasTheTextsOfTheAxesAndNoNumberThatIsNotFinite) {
  const ReportDocument document = example();
  const std::string svg =
      figure_plot(figures_of(document, {"twist", "residuals", "time"}), PlotFormat::svg);
  for (const char* text : {"twist [deg]", "torque [Nm]", "rate [deg/s]", "time [s]", "0.5;"})
    EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
  EXPECT_THAT(svg, Not(HasSubstr("hidden model")));
}

TEST(FigurePlot, DrawsAPeakOfOneSample) {
  TimeFigure time{.title = "t", .rate_Hz = 1000.0, .samples = 100'000};
  TimeSeries series{.label = "a", .overview = std::vector<float>(100'000, 0.0F), .detail = {}};
  time.panels.push_back({.label = "y", .series = {series}});
  ReportFigure figure = time;
  const std::string flat = figure_plot({&figure}, PlotFormat::svg);
  std::get<TimeFigure>(figure).panels[0].series[0].overview[54'321] = 7.0F;
  const std::string peak = figure_plot({&figure}, PlotFormat::svg);
  EXPECT_THAT(peak, HasSubstr("; 6; "));
  EXPECT_THAT(flat, Not(HasSubstr("; 6; ")));
}

TEST(FigurePlot, DrawsAxesForFiguresWithoutARange) {
  const ReportFigure empty = XyFigure{.title = "empty", .x = {"x"}, .y = {"y", true}, .series = {}};
  const ReportFigure point = XyFigure{.title = "point",
                                      .x = {"x", true},
                                      .y = {"y"},
                                      .series = {{.label = "a", .x = {2.0}, .y = {0.0}}}};
  const ReportFigure no_panel = TimeFigure{.title = "none"};
  const std::string svg = figure_plot({&empty, &point, &no_panel}, PlotFormat::svg);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, HasSubstr("point"));
}

/// The number after `key` in a text.
double number_after(const std::string& text, const std::string& key) {
  return std::stod(text.substr(text.find(key) + key.size()));
}

TEST(FigurePlot, PutsFiguresBesideEachOtherInColumns) {
  const XyFigure figure{.title = "t", .x = {"x"}, .y = {"y"}, .series = {}};
  const std::vector<ReportFigure> three(3, figure);
  const std::vector<const ReportFigure*> figures = {&three[0], &three[1], &three[2]};
  const std::string one = figure_plot({figures[0]}, PlotFormat::svg);
  const std::string rows = figure_plot(figures, PlotFormat::svg, {.columns = 2});
  EXPECT_NEAR(number_after(rows, "width=\""), 2.0 * number_after(one, "width=\""), 1.0);
  EXPECT_NEAR(number_after(rows, "height=\""), 2.0 * number_after(one, "height=\""), 1.0);
  EXPECT_THROW((void)figure_plot(figures, PlotFormat::svg, {.columns = 0}), UsageError);
  EXPECT_THROW((void)figure_plot({}, PlotFormat::svg), UsageError);
}

TEST(FigurePlot, FillsTheAreasOfAFieldByTheirValues) {
  FieldFigure field{.title = "strain", .value_label = "%", .highest = 20.0, .areas = {}};
  const ReportFigure empty = field;
  EXPECT_THAT(figure_plot({&empty}, PlotFormat::svg), HasSubstr("strain; 0; 20 %"));
  const auto square = [](double x, double value) {
    return FieldFigure::Area{.corners = {{x, 0.0}, {x + 1.0, 0.0}, {x + 1.0, 1.0}, {x, 1.0}},
                             .value = value};
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  field.areas = {square(0.0, 0.0), square(1.0, 25.0), square(2.0, nan)};
  const ReportFigure figure = field;
  const std::string svg = figure_plot({&figure}, PlotFormat::svg);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  const auto count = [&](const std::string& colour) {
    std::size_t found = 0;
    for (std::size_t at = svg.find(colour); at != std::string::npos; at = svg.find(colour, at + 1))
      ++found;
    return found;
  };
  // Each colour is that of an area and of one end of the scale.
  EXPECT_EQ(count("rgb(10%,15%,90%)"), 2U) << svg.substr(0, 6000);
  EXPECT_EQ(count("rgb(90%,15%,10%)"), 2U);
}

TEST(FigurePlot, AcceptsTextThatIsNotUtf8) {
  const ReportFigure figure =
      XyFigure{.title = "\xff\xfe file", .x = {"x"}, .y = {"y"}, .series = {}};
  for (const PlotFormat format : {PlotFormat::svg, PlotFormat::png, PlotFormat::pdf})
    EXPECT_NO_THROW((void)figure_plot({&figure}, format));
  EXPECT_THAT(figure_plot({&figure}, PlotFormat::svg), Not(HasSubstr("\xff")));
}

TEST(FigurePlot, NamesWhatItCanDraw) {
  const ReportDocument document = example();
  EXPECT_EQ(figures_of(document, {}, "residuals").front(), figures_of(document, {"rate"}).front());
  EXPECT_EQ(figures_of(document, {}, "none of them").front(), figures_of(document, {}).front());
  EXPECT_THAT(test::error_message([&] { return figures_of(document, {"colour"}); }),
              testing::AllOf(HasSubstr("'Residuals over rate'"), HasSubstr("found colour")));
  EXPECT_THAT(test::error_message([] { return figures_of({}, {}); }), HasSubstr("no figure"));
  EXPECT_THAT(test::error_message([] { return plot_format("a.gif"); }),
              HasSubstr(".svg, .png or .pdf"));
  EXPECT_EQ(plot_format("A.PDF"), PlotFormat::pdf);
}

TEST(FigurePlot, ReadsASizeInMillimetres) {
  EXPECT_EQ(plot_size("120x90.5mm").height_mm, 90.5);
  for (const char* bad : {"", "85", "85x", "85x60", "85x60cm", "x60mm", "39x60mm", "85x401mm",
                          "nanx60mm", "85x60mmm"})
    EXPECT_THAT(test::error_message([&] { return plot_size(bad); }), HasSubstr("85x64mm")) << bad;
}

}  // namespace
}  // namespace torsio
