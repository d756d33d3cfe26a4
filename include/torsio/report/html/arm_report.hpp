#pragma once

#include <string>
#include <vector>

#include "torsio/report/document/report_document.hpp"
#include "torsio/sim/arm/arm_run.hpp"
#include "torsio/sim/arm/arm_setup.hpp"

namespace torsio {

/// The page of `torsio arm`: scores, the arm drawn from the side and from above in poses of the run, torques of all
/// joints, and their sensors.
/// @param summary sentences
[[nodiscard]] ReportDocument arm_report(const ArmSetup& setup, const ArmRun& run,
                                        std::vector<std::string> summary);

/// The arm from the side (x and z of the base) and from above (x and y), one line per pose.
/// @param poses_rad one angle per joint; @param labels one per pose
[[nodiscard]] std::vector<ReportFigure> arm_figures(
    const ArmModel& arm, const std::vector<std::vector<double>>& poses_rad,
    const std::vector<std::string>& labels);

}  // namespace torsio
