#pragma once

#include <set>
#include <string>

#include "data/log_table.hpp"

namespace torsio {

/// @param used columns that need none: of masks, of `split_by`
/// @throws Error that names every other column without a unit, what each could be in a mapping, and the known units last.
void refuse_columns_without_unit(const LogTable& table, const std::set<const LogColumn*>& used);

/// How `torsio map` writes a draft of a mapping, from the values as well, which a message does not have.
[[nodiscard]] std::string advice_on_drafts(const LogTable& table);

}  // namespace torsio
