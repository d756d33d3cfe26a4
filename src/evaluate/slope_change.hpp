#pragma once

#include <string>
#include <vector>

#include "torsio/evaluate/evaluate.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// For each recording whose target rises by another factor than the estimate, by at least 5 %, or falls where it rises:
/// the factor over that of the training, and how to find the cause. Both lines, of the target over the
/// estimate and of the estimate over the target, must show it, so that neither noise nor a poor model is taken for it.
[[nodiscard]] std::vector<std::string> slope_warnings(const ModelFile& file,
                                                      const std::vector<ScoredRun>& runs);

}  // namespace torsio
