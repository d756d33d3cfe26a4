#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "torsio/core/error.hpp"
#include "torsio/report/plots.hpp"

namespace torsio {
namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++found;
  return found;
}

TEST(SvgPlot, PutsTheEndsOfALineAtTheCornersOfItsAxes) {
  const std::vector<double> x{0.0, 4.0};
  const std::vector<double> y{-2.0, 2.0};
  const std::string svg = svg_plot({{"", x, y}}, {"x", "y"}, "line");
  EXPECT_NE(svg.find("M58.0 284.0L426.0 32.0"), std::string::npos) << svg;
  for (const char* tick : {">-2<", ">-1<", ">0<", ">1<", ">2<", ">3<", ">4<"})
    EXPECT_NE(svg.find(tick), std::string::npos) << tick;
}

TEST(SvgPlot, LeavesOutWhatCannotBeSeen) {
  std::vector<double> x(100000);
  std::vector<double> y(100000);
  for (std::size_t i = 0; i < x.size(); ++i) {
    x[i] = std::cos(1e-3 * static_cast<double>(i));
    y[i] = std::sin(1e-3 * static_cast<double>(i));
  }
  x[500] = std::nan("");
  const std::string svg = svg_plot({{"", x, y}}, {"x", "y"}, "circles");
  EXPECT_LT(count(svg, "L"), 60000U);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
}

TEST(SvgPlot, EscapesTextAndNamesCurvesIfThereIsMoreThanOne) {
  const std::vector<double> x{0.0, 1.0};
  const std::string svg = svg_plot({{"a<b", x, x}, {"c", x, x}}, {"x & x", "y"}, "\"quoted\"");
  EXPECT_NE(svg.find("a&lt;b"), std::string::npos);
  EXPECT_NE(svg.find("x &amp; x"), std::string::npos);
  EXPECT_NE(svg.find("&quot;quoted&quot;"), std::string::npos);
  EXPECT_EQ(svg_plot({{"alone", x, x}}, {"x", "y"}, "t").find("alone"), std::string::npos);
}

TEST(SvgGrid, PutsPicturesSideBySideInRows) {
  const std::string svg = svg_grid({"<svg>a</svg>", "<svg>b</svg>", "<svg>c</svg>"}, 2);
  EXPECT_NE(svg.find("viewBox=\"0 0 880 660\""), std::string::npos) << svg;
  EXPECT_NE(svg.find("translate(0 0)\">\n<svg>a"), std::string::npos);
  EXPECT_NE(svg.find("translate(440 0)\">\n<svg>b"), std::string::npos);
  EXPECT_NE(svg.find("translate(0 330)\">\n<svg>c"), std::string::npos);
  EXPECT_THROW((void)svg_grid({}, 2), UsageError);
  EXPECT_THROW((void)svg_grid({"<svg/>"}, 0), UsageError);
}

TEST(SvgPlot, DrawsAnEmptyFrameForNothing) {
  const std::string svg = svg_plot({}, {"x", "y"}, "nothing");
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  const std::vector<double> one{3.0};
  EXPECT_EQ(svg_plot({{"", one, one}}, {"x", "y"}, "point").find("nan"), std::string::npos);
}

}  // namespace
}  // namespace torsio
