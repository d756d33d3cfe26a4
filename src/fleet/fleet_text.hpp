#pragma once

#include <cstddef>
#include <string>

#include "fleet/calibration.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// The joints of each type: medians, limits and outliers; then the outliers, then the joints.
[[nodiscard]] std::string fleet_text(const FleetCalibration& fleet);
[[nodiscard]] std::string fleet_json(const FleetCalibration& fleet);

/// The page of all joints.
[[nodiscard]] ReportDocument fleet_report(const FleetCalibration& fleet);
/// The page of one joint among those of its type.
[[nodiscard]] ReportDocument fleet_joint_report(const FleetCalibration& fleet, std::size_t joint);

}  // namespace torsio
