#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace torsio {

/// One curve of a plot; x and y have the same length. Points that are not finite are skipped.
struct Curve {
  std::string label;
  std::span<const double> x;
  std::span<const double> y;
};

struct PlotLabels {
  std::string x;
  std::string y;
};

/// Draws curves as braille dots, two by four per character, with axes; several curves share the
/// canvas (their labels are printed below it, marked by the curve that was drawn last). Non-finite
/// points are skipped; without a point the frame is empty.
[[nodiscard]] std::string terminal_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                                        std::size_t columns = 64, std::size_t rows = 16);

}  // namespace torsio
