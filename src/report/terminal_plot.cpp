#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>

#include "plot_range.hpp"
#include "report/plots.hpp"

namespace torsio {
namespace {

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
  const auto [x_range, y_range] = ranges_of(curves);
  if (x_range.is_empty()) return "(nothing to draw)\n";

  Canvas canvas(columns, rows);
  for (const Curve& curve : curves)
    for_each_point(curve, [&, x_of = x_range, y_of = y_range](double x, double y) {
      canvas.dot(x_of.share(x), y_of.share(y));
    });

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
