#include "torsio/report/terminal_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace torsio {
namespace {

struct Range {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();

  void include(double value) {
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  [[nodiscard]] bool is_empty() const { return !(lowest <= highest); }
  [[nodiscard]] double share(double value) const {
    return highest > lowest ? (value - lowest) / (highest - lowest) : 0.5;
  }
};

/// A grid of dots, eight to a character, in Unicode's braille block.
class Canvas {
 public:
  Canvas(std::size_t columns, std::size_t rows)
      : columns_(columns), rows_(rows), cells_(columns * rows, 0) {}

  void dot(double x_share, double y_share) {
    const auto px =
        static_cast<std::size_t>(std::lround(x_share * static_cast<double>(2 * columns_ - 1)));
    const auto py =
        static_cast<std::size_t>(std::lround((1.0 - y_share) * static_cast<double>(4 * rows_ - 1)));
    static constexpr std::array<std::array<std::uint8_t, 2>, 4> kBits{
        {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}}};
    cells_[(py / 4) * columns_ + px / 2] |= kBits[py % 4][px % 2];
  }

  [[nodiscard]] std::string row(std::size_t index) const {
    std::string text;
    for (std::size_t column = 0; column < columns_; ++column) {
      const unsigned bits = cells_[index * columns_ + column];  // U+2800 + bits as UTF-8
      text += static_cast<char>(0xE2);
      text += static_cast<char>(0xA0 | (bits >> 6));
      text += static_cast<char>(0x80 | (bits & 0x3F));
    }
    return text;
  }

 private:
  std::size_t columns_;
  std::size_t rows_;
  std::vector<std::uint8_t> cells_;
};

}  // namespace

std::string terminal_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                          std::size_t columns, std::size_t rows) {
  Range x_range;
  Range y_range;
  const auto for_each_point = [&curves](auto&& use) {
    for (const Curve& curve : curves)
      for (std::size_t i = 0; i < curve.x.size(); ++i)
        if (std::isfinite(curve.x[i]) && std::isfinite(curve.y[i])) use(curve.x[i], curve.y[i]);
  };
  for_each_point([&](double x, double y) {
    x_range.include(x);
    y_range.include(y);
  });
  if (x_range.is_empty()) return "(nothing to draw)\n";

  Canvas canvas(columns, rows);
  for_each_point([&](double x, double y) { canvas.dot(x_range.share(x), y_range.share(y)); });

  std::string text = fmt::format("{:>10} {}\n", "", labels.y);
  for (std::size_t row = 0; row < rows; ++row) {
    std::string tick;
    if (row == 0) tick = fmt::format("{:.4g}", y_range.highest);
    if (row + 1 == rows) tick = fmt::format("{:.4g}", y_range.lowest);
    text += fmt::format("{:>10} |{}\n", tick, canvas.row(row));
  }
  std::string axis;
  for (std::size_t column = 0; column < columns; ++column) axis += '-';
  text += fmt::format("{:>10} +{}\n", "", axis);
  const std::string left = fmt::format("{:.4g}", x_range.lowest);
  const std::string right = fmt::format("{:.4g}  {}", x_range.highest, labels.x);
  const std::size_t gap =
      columns > left.size() + right.size() ? columns - left.size() - right.size() : 1;
  text += fmt::format("{:>12}{}{:>{}}{}\n", "", left, "", gap, right);
  for (const Curve& curve : curves)
    if (!curve.label.empty()) text += fmt::format("{:>12}{}\n", "", curve.label);
  return text;
}

}  // namespace torsio
