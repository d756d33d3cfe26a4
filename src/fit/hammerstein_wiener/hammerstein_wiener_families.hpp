#pragma once

#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// `hammerstein_wiener`.
[[nodiscard]] std::vector<FamilyInfo> hammerstein_wiener_families();

}  // namespace torsio
