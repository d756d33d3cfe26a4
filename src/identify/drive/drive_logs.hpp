#pragma once

#include <optional>
#include <string>
#include <vector>

#include "identify/drive/drive_log.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/identify/drive/drive_sheet.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The drive file with the error gain that the duty of the recordings shows, if it is to be measured.
struct MeasuredDrive {
  DriveSheet sheet;
  std::optional<MeasuredErrorGain> error_gain;
};
[[nodiscard]] MeasuredDrive measured_drive(const std::vector<Recording>& recordings,
                                           const DriveSheet& sheet);

/// @throws Error naming recording and channel if one is missing or has a value that is not finite.
[[nodiscard]] DriveLog drive_log(const Recording& recording, const LoadSheet& load,
                                 const DriveSheet& drive);

/// One for each recording, without groups.
[[nodiscard]] std::vector<DriveLog> drive_logs(const std::vector<Recording>& recordings,
                                               const LoadSheet& load, const DriveSheet& drive);

/// Name of the channel that the free runs are compared with.
[[nodiscard]] std::string angle_channel(const Recording& recording, const DriveSheet& drive);

/// The group of each recording, by which they are left out.
[[nodiscard]] std::vector<std::string> drive_groups(const std::vector<Recording>& recordings,
                                                    const std::string& group_by);

}  // namespace torsio
