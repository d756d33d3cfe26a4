#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "identify/drive/drive_log.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/identify/drive/drive_sheet.hpp"

namespace torsio {

inline constexpr std::size_t kFewestDriveSamples = 20;

/// @throws Error naming the first sample that is not finite.
[[nodiscard]] const std::vector<double>& finite_channel(const Recording& recording,
                                                        const std::string& name);

/// Name of the channel that the law's command is in.
[[nodiscard]] std::string command_channel(const Recording& recording, const DriveSheet& drive);

/// The angle that the free runs are compared with, after the gear.
[[nodiscard]] std::vector<double> angle_after_gear(const Recording& recording,
                                                   const DriveSheet& drive);

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
