#pragma once

#include <span>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// `hammerstein_wiener`.
[[nodiscard]] std::span<const FamilyInfo> hammerstein_wiener_families() noexcept;

}  // namespace torsio
