#pragma once

#include <string>

#include "data/arrays/placed_bytes.hpp"
#include "data/read_budget.hpp"

namespace torsio {

/// Verifies what the library that reads MATLAB files of version 5 to 7 does not: that every element ends within
/// the one that contains it, that an array has as many bytes as its dimensions state, and the checksums of
/// packed variables. Files of other versions are not examined, except for the sizes in version 4. Source:
/// MathWorks, MAT-File Format.
/// @throws Error with the place of what is wrong, or beyond the budget.
void verify_mat(const PlacedBytes& bytes, ReadBudget& budget);

}  // namespace torsio
