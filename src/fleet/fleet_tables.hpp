#pragma once

#include <cstddef>
#include <string>

#include "fleet/calibration.hpp"
#include "torsio/report/text_table.hpp"

// What text and pages of a fleet have in common.
namespace torsio {

/// The traits of a joint of the type that has some, for their units.
[[nodiscard]] const JointTraits& example_of(const FleetCalibration& fleet, const std::string& type);
[[nodiscard]] std::size_t outliers_in(const OutlierTest& test);
/// "8.3 %", "0.052 deg", "0.12 Nm": relative traits in per cent, angles in degrees.
[[nodiscard]] std::string trait_text(const JointTraits::Value& of, double value);
/// Three digits; "-" for what is not measured.
[[nodiscard]] std::string short_value(double value);
/// "1 joint", "2 joints"
[[nodiscard]] std::string plural(std::size_t count, const char* one);

/// Number of joints, of models and of those that differ.
[[nodiscard]] std::string head_text(const FleetCalibration& fleet);
/// How the limits of a type were found.
[[nodiscard]] std::string tails_text(const FleetCalibration::OfType& type);
[[nodiscard]] std::string kind_text(const FleetCalibration& fleet, const FleetOutlier& outlier);

/// The limits of each trait.
[[nodiscard]] TextTable traits_table(const FleetCalibration& fleet,
                                     const FleetCalibration::OfType& type);
[[nodiscard]] TextTable outlier_table(const FleetCalibration& fleet);
/// The models of the first joints.
[[nodiscard]] TextTable joint_table(const FleetCalibration& fleet, std::size_t max_joints);

}  // namespace torsio
