#pragma once

#include <string>
#include <vector>

#include "torsio/report/curve.hpp"

namespace torsio {

/// Draws curves as lines into an SVG picture without external files: axes through round numbers,
/// a grid, a legend if there is more than one curve. Points closer than 0.8 pixels are
/// left out, so that long records make small files. All text is escaped.
[[nodiscard]] std::string svg_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                                   const std::string& title);

}  // namespace torsio
