#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace torsio {

/// Marks of new samples (`Channel::fresh`) of a sensor whose last value is written in every row: the first value, and
/// each one that differs from that before.
[[nodiscard]] inline std::vector<std::uint8_t> marks_of_changes(const std::vector<double>& values) {
  std::vector<std::uint8_t> marks(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    marks[i] = i == 0 || values[i] != values[i - 1] ? 1 : 0;
  return marks;
}

}  // namespace torsio
