#include "fit/common/usable_table.hpp"

#include <algorithm>

#include "torsio/fit/common/training_data.hpp"

namespace torsio {

std::size_t TrainingData::usable_samples() const noexcept {
  std::size_t count = 0;
  for (const Sequence& sequence : sequences)
    count += static_cast<std::size_t>(
        std::ranges::count_if(sequence.use, [](std::uint8_t use) { return use != 0; }));
  return count;
}

Table usable_table(const TrainingData& data) {
  const std::size_t count = data.usable_samples();
  Table table{Matrix(count, data.input_count()), {}};
  table.target.reserve(count);
  for (const Sequence& sequence : data.sequences) {
    for (std::size_t n = 0; n < sequence.target.size(); ++n) {
      if (sequence.use[n] == 0) continue;
      std::ranges::copy(sequence.features.row(n), table.features.row(table.target.size()).begin());
      table.target.push_back(sequence.target[n]);
    }
  }
  return table;
}

}  // namespace torsio
