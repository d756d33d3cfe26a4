#pragma once

#include <span>
#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// `arx`, and the `narx_` variants of static families.
/// @param known the static ones. Call once: the list points to options that it keeps.
[[nodiscard]] std::vector<FamilyInfo> narx_families(std::span<const FamilyInfo> known);

}  // namespace torsio
