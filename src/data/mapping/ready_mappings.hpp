#pragma once

#include <string_view>

namespace torsio {

/// The YAML text of a mapping in `share/torsio/mappings`, by its name; empty if there is none.
[[nodiscard]] std::string_view ready_mapping(std::string_view name) noexcept;

}  // namespace torsio
