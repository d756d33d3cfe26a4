#pragma once

#include <span>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The rows of the hysteresis operators in the table of families.
[[nodiscard]] std::span<const FamilyInfo> hysteresis_families() noexcept;

}  // namespace torsio
