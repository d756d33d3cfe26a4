#pragma once

#include <map>
#include <string>
#include <string_view>

#include "fleet/calibration.hpp"

namespace torsio {

/// Hashes of files (SHA-256) by their paths.
using FileHashes = std::map<std::string, std::string>;

/// A joint with the hashes of its files, as a trial keeps it.
[[nodiscard]] std::string task_text(const FleetJoint& joint, const FileHashes& sha256);
/// @param sha256 gets the hashes. @throws Error if the text is not of `task_text`.
[[nodiscard]] FleetJoint task_from_text(std::string_view text, FileHashes& sha256);

/// @throws Error if the text is not of `calibration_text`.
[[nodiscard]] CalibrationRequest calibration_from_text(std::string_view text);

/// In what two texts of `calibration_text` differ, for a person: "the joints or their recordings, seed (1, now 2)".
[[nodiscard]] std::string calibration_differences(std::string_view before, std::string_view now);

/// The result of a joint as JSON from which `joint_from_text` makes the same numbers.
[[nodiscard]] std::string joint_text(const CalibratedJoint& joint);
/// @throws Error if the text is not of `joint_text`.
[[nodiscard]] CalibratedJoint joint_from_text(std::string_view text);

}  // namespace torsio
