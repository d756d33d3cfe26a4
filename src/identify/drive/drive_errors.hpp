#pragma once

#include <vector>

#include "identify/drive/drive_fit.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The parameters of a solution, with standard errors from fits without one log each (delete-one jackknife) and from the
/// errors of the load and of a measured error gain, a fit each. Fewer than three logs: without.
/// @param relative_gain_error standard error of the laws' gain as a share of it; 0 or NaN: none
[[nodiscard]] std::vector<IdentifiedDriveParameter> parameters_with_errors(
    const std::vector<DriveLog>& logs, const DriveTerms& terms, const DriveValues& values,
    bool wants_errors, double relative_gain_error, const DriveFitOptions& options,
    std::size_t threads);

}  // namespace torsio
