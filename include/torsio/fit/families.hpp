#pragma once

#include <span>
#include <string_view>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// Every family that can be trained, cheapest first.
[[nodiscard]] std::span<const FamilyInfo> families() noexcept;

[[nodiscard]] bool has_option(const FamilyInfo& family, std::string_view option) noexcept;

/// @throws UsageError with the list and the nearest name if there is none of that name.
[[nodiscard]] const FamilyInfo& find_family(std::string_view name);

}  // namespace torsio
