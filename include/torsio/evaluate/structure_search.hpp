#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/cross_validation.hpp"
#include "torsio/fit/train_model.hpp"

namespace torsio {

/// How `--models` asks for a search.
inline constexpr std::string_view kSearch = "search";
/// Fits of each candidate.
inline constexpr std::size_t kSearchFolds = 3;

struct StructureSearch {
  std::vector<ModelChoice> winners;  ///< the best of each family, best family first
  CrossValidation scores;            ///< scores of all candidates
};

/// What a search tries: every choice of `model_choices(..., "all")`, linear systems, hysteresis and
/// networks of springs and dashpots that are slower to fit, and of each the orders, sizes and
/// structures that people vary first, one at a time.
[[nodiscard]] std::vector<ModelChoice> search_candidates(
    const Dataset& dataset, const std::vector<std::string>& wanted_inputs);

/// Structures chosen by cross-validation over the training records alone, so that held-out ones
/// still choose nothing: of each family the first in the ranking of `cross_validate`. A candidate
/// that is not ranked is not chosen.
/// @throws UsageError as `cross_validate`, Cancelled.
[[nodiscard]] StructureSearch search_structures(const Dataset& dataset,
                                                const std::vector<ModelChoice>& candidates,
                                                std::uint64_t seed, bool allow_leak,
                                                const Progress& progress = {});

}  // namespace torsio
