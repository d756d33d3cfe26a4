#pragma once

#include <span>

#include "torsio/fit/common/family_info.hpp"

namespace torsio {

/// The rows of the Gaussian processes in the table of families.
[[nodiscard]] std::span<const FamilyInfo> gaussian_process_families() noexcept;

}  // namespace torsio
