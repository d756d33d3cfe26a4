#include "torsio/report/plot/figure_plot.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "report/plot/angles.hpp"
#include "report/plot/label_places.hpp"
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

TEST(FigurePlot, HasAnglesInDegrees) {
  const XyFigure loop{.title = "loop",
                      .x = {"gear_angle_rad - joint_angle_rad [rad]"},
                      .y = {"torque over spring_Nm_rad [Nm]"},
                      .series = {{.label = "a", .x = {-M_PI, M_PI}, .y = {-M_PI, M_PI}}}};
  TimeFigure time{.title = "time", .rate_Hz = 1.0, .samples = 2};
  time.panels.push_back(
      {.label = "[rad/s]",
       .series = {{.label = "joint_speed_rad_s", .overview = {0.0F, 1.0F}, .detail = {}}}});
  const ReportFigure figures[] = {loop, time};
  const auto* const turned = std::get_if<XyFigure>(&figures[0]);
  const ReportFigure in_deg = in_degrees(figures[0]);
  const auto& converted = std::get<XyFigure>(in_deg);
  EXPECT_EQ(converted.x.label, "gear_angle_deg - joint_angle_deg [deg]");
  EXPECT_EQ(converted.y.label, turned->y.label) << "a stiffness stays";
  EXPECT_NEAR(converted.series[0].x[1], 180.0, 1e-9);
  EXPECT_EQ(converted.series[0].y[1], M_PI);
  const ReportFigure time_in_deg = in_degrees(figures[1]);
  const auto& panel = std::get<TimeFigure>(time_in_deg).panels.front();
  EXPECT_EQ(panel.label, "[deg/s]");
  EXPECT_EQ(panel.series.front().label, "joint_speed_deg_s");
  EXPECT_NEAR(panel.series.front().overview[1], 57.29578F, 1e-4F);
  EXPECT_THAT(figure_plot({&figures[0]}, PlotFormat::svg), HasSubstr("joint_angle_deg [deg]"));
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

TEST(FigurePlot, FillsAFieldOfZerosByTheLowestShade) {
  const ReportFigure zeros =
      FieldFigure{.title = "strain",
                  .value_label = "%",
                  .highest = 0.0,
                  .areas = {{.corners = {{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}}, .value = 0.0}}};
  const std::string svg = figure_plot({&zeros}, PlotFormat::svg);
  const std::string lowest = "rgb(10%,15%,90%)";
  const std::size_t scale = svg.find(lowest);
  ASSERT_NE(scale, std::string::npos);
  EXPECT_NE(svg.find(lowest, scale + 1), std::string::npos) << "the area beside the scale";
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

TEST(FigurePlot, DrawsEveryFigureThatAWordMatchesOnce) {
  const ReportDocument document = example();
  const auto figures = figures_of(document, {"over", "rate"});
  ASSERT_EQ(figures.size(), 3U);
  EXPECT_EQ(title_of(*figures[0]), "Torque over twist");
  EXPECT_EQ(title_of(*figures[1]), "Residuals over rate");
  EXPECT_EQ(title_of(*figures[2]), "Channels over time");
}

/// Errors and times of 13 models as `compare` draws them: most errors are within a factor of seven.
XyFigure crowded_figure() {
  XySeries models{.label = "models", .style = CurveStyle::points, .x = {}, .y = {}};
  const std::vector<double> errors = {0.15, 0.27, 0.44, 0.74, 0.85, 0.86, 0.88,
                                      0.89, 0.95, 0.97, 1.0,  1.06, 7.1};
  const std::vector<double> times_ns = {160,   140, 130, 150, 121, 1262, 431,
                                        16314, 290, 152, 120, 80,  441};
  models.x = times_ns;
  models.y = errors;
  for (std::size_t i = 0; i < errors.size(); ++i)
    models.names.push_back(fmt::format("model_with_a_name_{}", i));
  return {.title = "Error against the time of a step",
          .x = {"median time of a step [ns]", true},
          .y = {"RMSE [Nm]", true},
          .series = {std::move(models)}};
}

TEST(FigurePlot, HasRoundTicksOnALogarithmicAxisOfFewDecades) {
  const ReportFigure figure = crowded_figure();
  const std::string svg = figure_plot({&figure}, PlotFormat::svg);
  for (const char* tick : {"; 0.2;", "; 0.5;", "; 1;", "; 2;", "; 100;", "; 1000;", "; 10000;"})
    EXPECT_THAT(svg, HasSubstr(tick));
  XyFigure narrow = crowded_figure();
  narrow.series[0].y.assign(narrow.series[0].y.size(), 1.1);
  narrow.series[0].y[0] = 1.4;
  const ReportFigure short_axis = narrow;
  const std::string multiples = figure_plot({&short_axis}, PlotFormat::svg);
  EXPECT_THAT(multiples, HasSubstr("; 1.2;"));
  EXPECT_THAT(multiples, HasSubstr("; 1.3;"));
}

TEST(FigurePlot, WritesTheNamesOfColumnsAndOfValues) {
  const ReportFigure columns = XyFigure{.title = "columns",
                                        .x = {""},
                                        .y = {"y"},
                                        .series = {{.label = "a",
                                                    .style = CurveStyle::columns,
                                                    .x = {0.0, 1.0},
                                                    .y = {1.0, 2.0},
                                                    .names = {"first input", "second input"}}}};
  TimeFigure time{.title = "t", .rate_Hz = 10.0, .samples = 4};
  time.panels.push_back({.label = "fault_1",
                         .series = {{.label = "a", .overview = {0.0F, 2.0F}, .detail = {}}},
                         .value_names = {"none", "warming_up", "diverged"}});
  const ReportFigure faults = time;
  const std::string svg = figure_plot({&columns, &faults}, PlotFormat::svg);
  for (const char* text : {"first input", "second input", "none", "diverged"})
    EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_THAT(svg, Not(HasSubstr("warming_up"))) << "it does not occur";
}

TEST(FigurePlot, DrawsAPanelOfStatesWithoutANumber) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  TimeFigure time{.title = "t", .rate_Hz = 10.0, .samples = 2};
  time.panels.push_back({.label = "fault_1",
                         .series = {{.label = "a", .overview = {kNaN, kNaN}, .detail = {}}},
                         .value_names = {"none", "diverged"}});
  const ReportFigure figure = time;
  const std::string svg = figure_plot({&figure}, PlotFormat::svg);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

bool do_boxes_overlap(const PlotArea& a, const PlotArea& b) {
  return a.left < b.left + b.width && b.left < a.left + a.width && a.top < b.top + b.height &&
         b.top < a.top + a.height;
}

TEST(FigurePlot, HasUnitsOfOneLengthOnEqualAxes) {
  XyFigure figure{.title = "t",
                  .x = {"x"},
                  .y = {"y"},
                  .series = {{.label = "a", .x = {-1.0, 1.0}, .y = {-0.1, 0.1}}}};
  const ReportFigure own_ranges = figure;
  figure.is_equal = true;
  const ReportFigure equal = figure;
  EXPECT_THAT(figure_plot({&own_ranges}, PlotFormat::svg), HasSubstr("; 0.1;"));
  const std::string svg = figure_plot({&equal}, PlotFormat::svg);
  EXPECT_THAT(svg, Not(HasSubstr("; 0.1;")));
  EXPECT_THAT(svg, HasSubstr("; 0.5; "));
}

TEST(PlaceLabels, AreWithinTheAreaAndNotOverEachOther) {
  const PlotArea area{.left = 20.0, .top = 10.0, .width = 200.0, .height = 110.0};
  std::vector<PlotPoint> points;
  for (int i = 0; i < 13; ++i)
    points.push_back({area.left + 1.0 + 5.0 * i, area.top + 60.0 + 3.0 * (i % 3)});
  const std::vector<LabelSize> sizes(points.size(), {.width = 50.0, .height = 8.0});
  const auto places = place_labels(points, sizes, area, {{points.front(), points.back()}});
  std::size_t placed = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!places[i]) continue;
    ++placed;
    const PlotArea& box = places[i]->box;
    EXPECT_GE(box.left, area.left);
    EXPECT_LE(box.left + box.width, area.left + area.width);
    EXPECT_GE(box.top, area.top);
    EXPECT_LE(box.top + box.height, area.top + area.height);
    for (std::size_t k = 0; k < i; ++k)
      EXPECT_FALSE(places[k] && do_boxes_overlap(box, places[k]->box)) << i << " and " << k;
  }
  EXPECT_GE(placed, 12U);
}

TEST(PlaceLabels, HasNoPlaceForANameThatIsWiderThanTheArea) {
  const PlotArea area{.left = 0.0, .top = 0.0, .width = 40.0, .height = 40.0};
  const auto places = place_labels({{20.0, 20.0}}, {{.width = 50.0, .height = 8.0}}, area, {});
  EXPECT_FALSE(places.front().has_value());
}

TEST(FigurePlot, ReadsASizeInMillimetres) {
  EXPECT_EQ(plot_size("120x90.5mm").height_mm, 90.5);
  for (const char* bad : {"", "85", "85x", "85x60", "85x60cm", "x60mm", "39x60mm", "85x401mm",
                          "nanx60mm", "85x60mmm"})
    EXPECT_THAT(test::error_message([&] { return plot_size(bad); }), HasSubstr("85x64mm")) << bad;
}

}  // namespace
}  // namespace torsio
