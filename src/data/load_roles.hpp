#pragma once

#include <string>
#include <vector>

#include "torsio/data/load.hpp"

namespace torsio {

/// `load_dataset` with recordings whose role is validation, whatever a manifest gives them. A target that the
/// caller adds (`LoadOptions::computes_target`) is checked by the caller.
[[nodiscard]] Dataset load_with_validation(const std::vector<std::string>& train_files,
                                           const std::vector<std::string>& validation_files,
                                           const std::vector<std::string>& test_files,
                                           const LoadOptions& options);

}  // namespace torsio
