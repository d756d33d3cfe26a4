#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace torsio {

/// One curve of a terminal plot; x and y have the same length.
struct Curve {
  std::string label;
  std::span<const double> x;
  std::span<const double> y;
};

struct PlotLabels {
  std::string x;
  std::string y;
};

/// Draws curves as braille dots, two by four a character, with axes; several curves share the
/// canvas (their labels stand below, marked by which was drawn last on top). Non-finite points are
/// skipped; no point gives an empty frame.
[[nodiscard]] std::string terminal_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                                        std::size_t columns = 64, std::size_t rows = 16);

}  // namespace torsio
