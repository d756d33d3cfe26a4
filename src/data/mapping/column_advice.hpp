#pragma once

#include <string>
#include <string_view>

namespace torsio {

/// What to do about a column whose name ends in no known unit: the mapping line that would read it,
/// with the quantity that its name speaks of. An unknown unit is asked for as `scale:`, never taken
/// for a known one.
[[nodiscard]] std::string advice_without_unit(std::string_view column_name);

}  // namespace torsio
