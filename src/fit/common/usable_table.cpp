#include "fit/common/usable_table.hpp"

#include <algorithm>
#include <span>

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
  for_each_usable(data, [&](std::span<const double> features, double target) {
    std::ranges::copy(features, table.features.row(table.target.size()).begin());
    table.target.push_back(target);
  });
  return table;
}

}  // namespace torsio
