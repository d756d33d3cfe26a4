#pragma once

#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The rows of `mlp`, `lstm` and `gru` in the table of families.
[[nodiscard]] std::vector<FamilyInfo> network_families();

}  // namespace torsio
