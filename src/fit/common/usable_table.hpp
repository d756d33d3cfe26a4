#pragma once

#include <cstddef>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// The usable samples of all sequences in one table, for families without memory.
struct Table {
  Matrix features;
  std::vector<double> target;
};

[[nodiscard]] Table usable_table(const TrainingData& data);

/// Calls `visit(features, target)` for the same samples in the same order, without a table.
template <class Visit>
void for_each_usable(const TrainingData& data, const Visit& visit) {
  for (const Sequence& sequence : data.sequences)
    for (std::size_t n = 0; n < sequence.target.size(); ++n)
      if (sequence.use[n] != 0) visit(sequence.features.row(n), sequence.target[n]);
}

}  // namespace torsio
