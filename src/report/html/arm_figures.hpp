#pragma once

#include <string>
#include <vector>

#include "torsio/arm/arm_model.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/report/text_table.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {

/// The arm from the side (x and z of the base) and from above (x and y), one line per pose.
/// @param poses_rad one angle per joint
/// @param labels one per pose
[[nodiscard]] std::vector<ReportFigure> arm_figures(
    const ArmModel& arm, const std::vector<std::vector<double>>& poses_rad,
    const std::vector<std::string>& labels);

/// The scores of the joints of a run.
[[nodiscard]] TextTable arm_scores(const ArmRun& run);

}  // namespace torsio
