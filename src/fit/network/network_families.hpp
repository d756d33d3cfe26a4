#pragma once

#include <span>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The rows of `mlp`, `lstm` and `gru` in the table of families.
[[nodiscard]] std::span<const FamilyInfo> network_families() noexcept;

}  // namespace torsio
