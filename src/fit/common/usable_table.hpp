#pragma once

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

}  // namespace torsio
