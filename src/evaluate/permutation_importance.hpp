#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/fit/common/training_data.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

struct PermutationImportance {
  double rmse = 0.0;
  std::size_t samples = 0;
  std::size_t block_samples = 0;
  std::vector<std::vector<double>> increase;  ///< by input and repeat
};

/// @param by_sequence the estimates of each sequence.
/// @param shortest_block blocks have this length or one second, whichever is longer, but are short
/// enough for 20 of them if the data are few.
[[nodiscard]] PermutationImportance permutation_importance(
    const AnyModel& model, const TrainingData& data,
    const std::vector<std::vector<Estimate>>& by_sequence, std::size_t shortest_block,
    std::size_t repeats, std::uint64_t seed, std::size_t threads, const Progress& progress);

}  // namespace torsio
