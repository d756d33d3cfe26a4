#pragma once

#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// Advice for an unknown name: "It is now called 'rigid_drive'." if an older version had the name,
/// "Did you mean 'rebuild'?" if one of the names is at most a third of its letters away (edit
/// distance), else empty.
[[nodiscard]] std::string did_you_mean(std::string_view wrong,
                                       std::span<const std::string_view> names);
[[nodiscard]] std::string did_you_mean(std::string_view wrong, std::span<const std::string> names);

}  // namespace torsio
