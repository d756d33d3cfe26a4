#pragma once

#include <span>
#include <string>
#include <string_view>

namespace torsio {

/// "Did you mean 'rebuild'?" when one of the names is at most a third of its letters away (edit
/// distance); else empty.
[[nodiscard]] std::string did_you_mean(std::string_view wrong,
                                       std::span<const std::string_view> names);
[[nodiscard]] std::string did_you_mean(std::string_view wrong, std::span<const std::string> names);

}  // namespace torsio
