#pragma once

#include "torsio/model/any_model.hpp"

namespace torsio {

/// The parameters of gain f(x) + offset, where f has these.
/// @throws UsageError for a family for which there is no such map.
[[nodiscard]] AnyModel::Parameters with_output(AnyModel::Parameters parameters, double gain,
                                               double offset);

/// Whether there is one.
[[nodiscard]] bool can_map_output(const AnyModel::Parameters& parameters);

}  // namespace torsio
