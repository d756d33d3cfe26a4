#pragma once

#include <string>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// The values of a channel that a model uses, all of them finite.
/// @throws Error with the time of the first that is not, and what to do about it.
[[nodiscard]] const std::vector<double>& finite_input(const Recording& recording,
                                                      const std::string& channel);

}  // namespace torsio
