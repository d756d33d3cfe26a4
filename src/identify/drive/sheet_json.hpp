#pragma once

#include <nlohmann/json.hpp>

#include "torsio/identify/drive/drive_sheet.hpp"
#include "torsio/joint_load/known_load.hpp"

namespace torsio {

/// A load as its file states it (JSON is YAML): `parse_load_sheet` of the text gives the load again. The path of a URDF
/// becomes absolute.
[[nodiscard]] nlohmann::ordered_json load_sheet_json(const LoadSheet& load);
/// The same for the law of a drive and `parse_drive_sheet`.
[[nodiscard]] nlohmann::ordered_json drive_sheet_json(const DriveSheet& drive);

}  // namespace torsio
