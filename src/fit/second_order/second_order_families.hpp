#pragma once

#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// Masses with friction and hysteresis, driven by a force: `dynamic_bouc_wen`, `rigid_drive`.
[[nodiscard]] std::vector<FamilyInfo> second_order_families();

}  // namespace torsio
