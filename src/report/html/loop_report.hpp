#pragma once

#include <span>
#include <string>
#include <vector>

#include "torsio/control/design/linear_system.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// A loop of one input and one output, cut open.
struct DrawnLoop {
  std::string label;  ///< "output locked"
  LinearSystem loop;
};

/// Bode diagrams of the loops with their margins, and Nyquist diagrams near the point -1.
[[nodiscard]] std::vector<ReportFigure> loop_figures(std::span<const DrawnLoop> loops);

/// Margins of the loops in a table, and `loop_figures`.
[[nodiscard]] ReportSection loop_section(std::span<const DrawnLoop> loops);

}  // namespace torsio
