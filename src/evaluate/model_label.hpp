#pragma once

#include <string>
#include <string_view>

#include "torsio/evaluate/results.hpp"

namespace torsio {

/// "polynomial[branch=false]"
[[nodiscard]] std::string model_label(std::string_view family, std::string_view variant);
/// "polynomial[branch=false] (with current)"
[[nodiscard]] std::string model_label(const ResultRow& row);

}  // namespace torsio
