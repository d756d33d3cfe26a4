#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/report/curve.hpp"

namespace torsio {

/// Draws curves as braille dots, two by four per character, with axes; several curves share the
/// canvas (their labels are printed below it, marked by the curve that was drawn last). Non-finite
/// points are skipped; without a point the frame is empty.
[[nodiscard]] std::string terminal_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                                        std::size_t columns = 64, std::size_t rows = 16);

}  // namespace torsio
