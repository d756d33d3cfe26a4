#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace torsio {

/// The actions of the table of promotions.
inline constexpr std::string_view kPromote = "promote";
inline constexpr std::string_view kRollBack = "roll back";

/// Follows the history of a device by one row. The last of `models` is the current one, those before it
/// are what can be rolled back to.
void follow(std::vector<std::int64_t>& models, std::string_view action, std::int64_t model);

}  // namespace torsio
