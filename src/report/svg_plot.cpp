#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "markup_text.hpp"
#include "plot_range.hpp"
#include "torsio/core/error.hpp"
#include "torsio/report/plots.hpp"

namespace torsio {
namespace {

constexpr double kWidth = 440.0;
constexpr double kHeight = 330.0;
constexpr double kLeft = 58.0;
constexpr double kRight = 14.0;
constexpr double kTop = 32.0;
constexpr double kBottom = 46.0;
constexpr double kSeen = 0.8;  // pixels
constexpr std::array<std::string_view, 4> kColours = {"#1f5fa8", "#c8501e", "#2d8a4e", "#7a3e9d"};

/// A range widened to whole ticks, and its position on the picture.
class Axis {
 public:
  Axis(const PlotRange& range, double from, double to)
      : step_(range.highest > range.lowest ? tick_step(range.highest - range.lowest) : 1.0),
        range_{std::floor(range.lowest / step_) * step_, std::ceil(range.highest / step_) * step_},
        from_(from),
        to_(to) {}

  [[nodiscard]] double at(double value) const {
    return from_ + range_.share(value) * (to_ - from_);
  }
  template <class Use>
  void for_each_tick(const Use& use) const {
    const auto ticks = static_cast<int>(std::lround((range_.highest - range_.lowest) / step_));
    for (int i = 0; i <= ticks; ++i) {
      const double value = range_.lowest + i * step_;
      use(std::abs(value) < 1e-9 * step_ ? 0.0 : value);
    }
  }

 private:
  double step_;
  PlotRange range_;
  double from_;
  double to_;
};

std::string grid(const Axis& x, const Axis& y) {
  std::string text;
  const double bottom = kHeight - kBottom;
  x.for_each_tick([&](double value) {
    text += fmt::format(
        "<path d=\"M{0:.1f} {1}V{2}\" class=\"g\"/><text x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4:g}</text>\n",
        x.at(value), kTop, bottom, bottom + 15.0, value);
  });
  y.for_each_tick([&](double value) {
    text += fmt::format(
        "<path d=\"M{1} {0:.1f}H{2}\" class=\"g\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5:g}</text>\n",
        y.at(value), kLeft, kWidth - kRight, kLeft - 6.0, y.at(value) + 4.0, value);
  });
  return text;
}

std::string line(const Curve& curve, const Axis& x, const Axis& y, std::string_view colour) {
  std::string path;
  double last_x = -1e9;
  double last_y = -1e9;
  for_each_point(curve, [&](double x_value, double y_value) {
    const double at_x = x.at(x_value);
    const double at_y = y.at(y_value);
    if (std::hypot(at_x - last_x, at_y - last_y) < kSeen) return;
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", at_x, at_y);
    last_x = at_x;
    last_y = at_y;
  });
  return fmt::format("<path d=\"{}\" stroke=\"{}\" class=\"c\"/>\n", path, colour);
}

}  // namespace

std::string svg_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                     const std::string& title) {
  PlotRanges ranges = ranges_of(curves);
  if (ranges.x.is_empty()) ranges = {.x = {0.0, 1.0}, .y = {0.0, 1.0}};
  const Axis x(ranges.x, kLeft, kWidth - kRight);
  const Axis y(ranges.y, kHeight - kBottom, kTop);
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"11\" fill=\"#333\">\n"
      "<style>.g{{stroke:#ddd;fill:none}}.c{{fill:none;stroke-width:1.1}}</style>\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
      kWidth, kHeight);
  text += grid(x, y);
  for (std::size_t i = 0; i < curves.size(); ++i)
    text += line(curves[i], x, y, kColours[i % kColours.size()]);
  const double middle_x = 0.5 * (kLeft + kWidth - kRight);
  const double middle_y = 0.5 * (kTop + kHeight - kBottom);
  text += fmt::format("<text x=\"{}\" y=\"18\" font-size=\"13\">{}</text>\n", kLeft,
                      markup_text(title));
  text += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n", middle_x,
                      kHeight - 12.0, markup_text(labels.x));
  text += fmt::format(
      "<text transform=\"translate(14 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      middle_y, markup_text(labels.y));
  for (std::size_t i = 0; curves.size() > 1 && i < curves.size(); ++i)
    text += fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>\n", kLeft + 8.0,
                        kTop + 14.0 * static_cast<double>(i + 1), kColours[i % kColours.size()],
                        markup_text(curves[i].label));
  return text + "</svg>\n";
}

std::string svg_grid(const std::vector<std::string>& plots, std::size_t columns) {
  if (plots.empty() || columns == 0)
    throw UsageError({.place = "svg_grid",
                      .expected = "at least one picture and one column",
                      .found = fmt::format("{} and {}", plots.size(), columns)});
  const std::size_t rows = (plots.size() + columns - 1) / columns;
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\">\n",
      kWidth * static_cast<double>(columns), kHeight * static_cast<double>(rows));
  for (std::size_t i = 0; i < plots.size(); ++i) {
    const std::size_t row = i / columns;
    text += fmt::format("<g transform=\"translate({} {})\">\n{}</g>\n",
                        kWidth * static_cast<double>(i % columns),
                        kHeight * static_cast<double>(row), plots[i]);
  }
  return text + "</svg>\n";
}

}  // namespace torsio
