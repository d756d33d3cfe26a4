#pragma once

#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The rows of the hysteresis operators in the table of families.
[[nodiscard]] std::vector<FamilyInfo> hysteresis_families();

}  // namespace torsio
