#pragma once

#include <string>
#include <string_view>

namespace torsio {

/// @throws Error "<place>: expected <name> <what>, found <value>" if a parameter is not as it must
/// be; NaN never is.
void require_positive(std::string_view place, std::string_view name, double value);
void require_not_negative(std::string_view place, std::string_view name, double value);
void require(bool holds, std::string_view place, const std::string& expected, double found);

}  // namespace torsio
