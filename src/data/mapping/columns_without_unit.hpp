#pragma once

#include <set>

#include "data/log_table.hpp"

namespace torsio {

/// @param used columns that need none: of masks, of `split_by`
/// @throws Error that names every other column without a unit, what each could be in a mapping, and the known units last.
void refuse_columns_without_unit(const LogTable& table, const std::set<const LogColumn*>& used);

}  // namespace torsio
