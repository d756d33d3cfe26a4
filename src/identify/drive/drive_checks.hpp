#pragma once

#include <vector>

#include "identify/drive/drive_log.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// What of the recordings keeps a model from being determined, before anything is fitted.
[[nodiscard]] std::vector<DriveFinding> check_drive_logs(const std::vector<Recording>& recordings,
                                                         const std::vector<DriveLog>& logs);

/// What a fit shows: parameters at their bounds, a peak of the gain that one mass misses.
[[nodiscard]] std::vector<DriveFinding> check_identified(const std::vector<DriveLog>& logs,
                                                         const DriveIdentification& identified);

}  // namespace torsio
