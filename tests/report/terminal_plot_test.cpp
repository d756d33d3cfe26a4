#include <gtest/gtest.h>

#include <cmath>

#include "report/plots.hpp"

namespace torsio {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n') {
      lines.emplace_back();
    } else {
      lines.back() += c;
    }
  }
  return lines;
}

TEST(TerminalPlot, DrawsARisingLineFromBottomLeftToTopRight) {
  const std::vector<double> x{0.0, 1.0, 2.0, 3.0};
  const auto lines = lines_of(terminal_plot({{"", x, x}}, {"x", "y"}, 8, 4));
  // Line 0 names y; the plot's rows follow, top first, each of 8 characters of 3 bytes after "|".
  const auto dots_at = [&](std::size_t row, std::size_t column) {
    const std::string& line = lines[1 + row];
    return line.substr(line.find('|') + 1 + 3 * column, 3) != "\u2800";
  };
  EXPECT_TRUE(dots_at(0, 7));
  EXPECT_TRUE(dots_at(3, 0));
  EXPECT_FALSE(dots_at(0, 0));
  EXPECT_FALSE(dots_at(3, 7));
}

TEST(TerminalPlot, NamesTheEndsOfItsAxes) {
  const std::vector<double> x{-2.0, 2.0};
  const std::vector<double> y{-7.5, 8.5};
  const std::string plot = terminal_plot({{"", x, y}}, {"angle_rad", "torque_Nm"});
  for (const char* text : {"-2", "2  angle_rad", "-7.5", "8.5", "torque_Nm"})
    EXPECT_NE(plot.find(text), std::string::npos) << text;
}

TEST(TerminalPlot, SkipsWhatIsNotFiniteAndMayBeEmpty) {
  const std::vector<double> x{std::nan(""), 1.0};
  const std::vector<double> y{1.0, std::nan("")};
  EXPECT_EQ(terminal_plot({{"", x, y}}, {"x", "y"}), "(nothing to draw)\n");
}

TEST(TerminalPlot, DrawsAConstantInTheMiddle) {
  const std::vector<double> x{1.0, 1.0};
  EXPECT_NE(terminal_plot({{"", x, x}}, {"x", "y"}).find("1  x"), std::string::npos);
}

}  // namespace
}  // namespace torsio
