#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/report/curve.hpp"

namespace torsio {

/// Draws curves as braille dots, two by four a character, with axes; several curves share the
/// canvas (their labels stand below, marked by which was drawn last on top). Non-finite points are
/// skipped; no point gives an empty frame.
[[nodiscard]] std::string terminal_plot(const std::vector<Curve>& curves, const PlotLabels& labels,
                                        std::size_t columns = 64, std::size_t rows = 16);

}  // namespace torsio
