#pragma once

#include <string>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// Findings, parameters with standard errors, and the errors of the free runs.
[[nodiscard]] std::string identification_text(const DriveIdentification& identified);
[[nodiscard]] std::string identification_json(const DriveIdentification& identified);

/// "delay, load_friction"; the base is not named.
[[nodiscard]] std::string terms_text(const DriveTerms& terms);

}  // namespace torsio
