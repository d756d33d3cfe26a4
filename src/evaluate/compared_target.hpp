#pragma once

#include <string>

#include "torsio/files/model_file.hpp"

namespace torsio {

/// The channel, as it is named inside torsio, with which the estimates of a model are to be compared.
/// @param wanted as a user names it; empty: the model's target
/// @throws UsageError unless it has the unit of the model's target.
[[nodiscard]] std::string compared_target(const ModelFile& file, const std::string& wanted);

}  // namespace torsio
