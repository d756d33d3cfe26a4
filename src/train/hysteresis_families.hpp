#pragma once

#include <span>

#include "torsio/train/families.hpp"

namespace torsio {

/// The rows of the hysteresis operators in the table of families.
[[nodiscard]] std::span<const FamilyInfo> hysteresis_families() noexcept;

}  // namespace torsio
