#pragma once

#include <string>
#include <vector>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// Findings, parameters with standard errors, and the errors of the free runs.
[[nodiscard]] std::string identification_text(const DriveIdentification& identified);
[[nodiscard]] std::string identification_json(const DriveIdentification& identified,
                                              const std::vector<DriveAdvice>& advice);

/// The recordings to make next.
[[nodiscard]] std::string drive_advice_text(const std::vector<DriveAdvice>& advice);

/// "delay, load_friction"; the base is not named.
[[nodiscard]] std::string terms_text(const DriveTerms& terms);

}  // namespace torsio
