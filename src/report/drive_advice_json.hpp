#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// A list with recording, parameter and the ratio of its standard error.
[[nodiscard]] nlohmann::ordered_json drive_advice_json(const std::vector<DriveAdvice>& advice);

}  // namespace torsio
