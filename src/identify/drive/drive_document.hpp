#pragma once

#include <nlohmann/json.hpp>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// `identified_drive_text` before it becomes text.
[[nodiscard]] nlohmann::ordered_json drive_document(const DriveIdentification& identified);

/// "delay, load_friction"; the base is not named.
[[nodiscard]] std::string terms_text(const DriveTerms& terms);

}  // namespace torsio
