#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

namespace torsio {

/// Parses untrusted JSON.
/// @param advice for a text that is not JSON
/// @throws Error at `place` for text that is not JSON, nested deeper than eight levels, or has a
/// key twice in one object.
[[nodiscard]] nlohmann::json parse_json(
    std::string_view text, std::string_view place,
    std::string_view advice = "The file is damaged: copy it again or fit the model again.");

/// A number that is not finite is null.
[[nodiscard]] nlohmann::ordered_json json_number(double value);

}  // namespace torsio
