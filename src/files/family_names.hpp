#pragma once

#include <string>
#include <string_view>

#include "torsio/model/any_model.hpp"

// What can be asked of `KnownFamilies` without including every family.

namespace torsio {

/// Empty parameters of a family, to be filled by whoever reads them.
/// @throws UsageError that lists the families if there is none of that name.
[[nodiscard]] AnyParameters parameters_of_family(std::string_view family);

/// "linear, linear_coulomb, ...": the families of `KnownFamilies`, for messages.
[[nodiscard]] std::string known_model_families();

}  // namespace torsio
