#pragma once

#include <cstddef>
#include <vector>

#include "identify/drive/drive_fit.hpp"
#include "identify/drive/drive_log.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// What of the recordings keeps a model from being determined, before anything is fitted.
[[nodiscard]] std::vector<DriveFinding> check_drive_logs(const std::vector<Recording>& recordings,
                                                         const std::vector<DriveLog>& logs);

/// Fails where an angle that stays where it began is as near to the motion as the free runs of a fit, or where another
/// direction of the angle or another zero of the load halves their error, which is itself above half of that of standing
/// still. These are searched for with the base of the model alone, and named.
[[nodiscard]] std::vector<DriveFinding> check_free_runs(const std::vector<DriveLog>& logs,
                                                        const DriveIdentification& identified,
                                                        const DriveFitOptions& options,
                                                        std::size_t threads);

/// What a fit shows: parameters at their bounds, and what one mass misses of an elastic joint.
[[nodiscard]] std::vector<DriveFinding> check_identified(const std::vector<Recording>& recordings,
                                                         const std::vector<DriveLog>& logs,
                                                         const DriveIdentification& identified);

}  // namespace torsio
