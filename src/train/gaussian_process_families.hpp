#pragma once

#include <span>

#include "torsio/train/families.hpp"

namespace torsio {

/// The rows of the Gaussian processes in the table of families.
[[nodiscard]] std::span<const FamilyInfo> gaussian_process_families() noexcept;

}  // namespace torsio
