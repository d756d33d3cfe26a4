#pragma once

#include <vector>

#include "identify/drive/drive_fit.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The parameters of a solution, with standard errors from fits without one log each (delete-one jackknife) and from the
/// errors of the load, a fit each. Fewer than three logs: without.
[[nodiscard]] std::vector<IdentifiedDriveParameter> parameters_with_errors(
    const std::vector<DriveLog>& logs, const DriveTerms& terms, const DriveValues& values,
    bool wants_errors, const DriveFitOptions& options, std::size_t threads);

}  // namespace torsio
