#pragma once

#include <span>

#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// Writes a variant into a sheet that has it.
void set_variant(DataSheet& sheet, std::string_view variant);
/// The same without the numbers that differ between variants.
void mark_variant(DataSheet& sheet, std::string_view variant);

}  // namespace torsio
