#pragma once

#include <map>
#include <string>
#include <string_view>

#include "fleet/calibration.hpp"

namespace torsio {

/// A joint of a study with the hashes of its files, as its trial keeps it.
struct JointTask {
  FleetJoint joint;
  std::map<std::string, std::string> sha256 = {};  ///< by path
};

[[nodiscard]] std::string task_text(const FleetJoint& joint);
/// @throws Error if the text is not of `task_text`.
[[nodiscard]] JointTask task_from_text(std::string_view text);

/// @throws Error if the text is not of `calibration_text`.
[[nodiscard]] CalibrationRequest calibration_from_text(std::string_view text);

/// The result of a joint as JSON from which `joint_from_text` makes the same numbers.
[[nodiscard]] std::string joint_text(const CalibratedJoint& joint);
/// @throws Error if the text is not of `joint_text`.
[[nodiscard]] CalibratedJoint joint_from_text(std::string_view text);

}  // namespace torsio
