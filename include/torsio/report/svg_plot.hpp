#pragma once

#include <string>
#include <vector>

#include "torsio/report/curve.hpp"

namespace torsio {

/// Draws curves as lines into an SVG picture that needs nothing else: axes through round numbers,
/// a grid, a legend if there is more than one curve. What cannot be seen at its size (0.8 pixels) is
/// left out, so that long records make small files. All text is escaped.
[[nodiscard]] std::string svg_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                                   const std::string& title);

}  // namespace torsio
