#pragma once

#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// `arx`, and the `narx_` variants of static families.
[[nodiscard]] std::vector<FamilyInfo> narx_families();

}  // namespace torsio
