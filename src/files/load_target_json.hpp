#pragma once

#include <nlohmann/json.hpp>

#include "files/json_object.hpp"
#include "torsio/core/load_target.hpp"

namespace torsio {

/// The entry `load` of a card (docs/robot/model_file.md).
[[nodiscard]] nlohmann::ordered_json load_target_json(const LoadTarget& load);
/// @throws Error naming what is missing or of another type.
[[nodiscard]] LoadTarget load_target_of(const JsonObject& load);

}  // namespace torsio
