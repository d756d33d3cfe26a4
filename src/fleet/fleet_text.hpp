#pragma once

#include <string>
#include <vector>

#include "fleet/calibration.hpp"
#include "torsio/report/document/report_document.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {

/// "8.3 %", "0.052 deg", "0.12 Nm": relative traits in per cent, angles in degrees.
[[nodiscard]] std::string trait_text(const JointTraits::Value& of, double value);

/// The joints of each type: medians, limits and outliers; then the outliers, then the joints.
[[nodiscard]] std::string fleet_text(const FleetCalibration& fleet);
[[nodiscard]] std::string fleet_json(const FleetCalibration& fleet);

/// The page of all joints.
[[nodiscard]] ReportDocument fleet_report(const FleetCalibration& fleet);
/// The page of one joint among those of its type.
[[nodiscard]] ReportDocument fleet_joint_report(const FleetCalibration& fleet, std::size_t joint);

}  // namespace torsio
