#pragma once

#include <vector>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The rows of the Gaussian processes in the table of families.
[[nodiscard]] std::vector<FamilyInfo> gaussian_process_families();

}  // namespace torsio
