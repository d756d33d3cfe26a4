#pragma once

#include <optional>
#include <vector>

#include "torsio/data/recording.hpp"
#include "torsio/identify/drive/drive_sheet.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The drive file with the error gain that the duty of the recordings shows, if it is to be measured.
struct MeasuredDrive {
  DriveSheet sheet;
  std::optional<MeasuredErrorGain> error_gain;
  std::vector<DriveFinding> findings = {};  ///< on the duty
};

/// duty = error_gain gain (goal a delay ago - angle) by least squares over the samples in which the duty is below its
/// limit and the error changes slowly; the delay is that with the least residual. Remarked are a residual that another
/// law would have, a recording whose own gain differs, and a limit of the duty below that of the drive file.
/// @throws Error if no recording has a duty that follows the error.
[[nodiscard]] MeasuredDrive measured_drive(const std::vector<Recording>& recordings,
                                           const DriveSheet& sheet);

}  // namespace torsio
