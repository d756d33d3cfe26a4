#pragma once

#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// The figure with its angles in degrees, as a page shows it at first (web/src/angles.ts): axes with
/// [rad], [rad/s] or [rad/s2], and `_deg` in the names of their channels.
[[nodiscard]] ReportFigure in_degrees(ReportFigure figure);

}  // namespace torsio
