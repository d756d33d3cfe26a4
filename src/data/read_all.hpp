#pragma once

#include <cstddef>
#include <string>

#include "data/byte_source.hpp"
#include "data/read_budget.hpp"

namespace torsio {

/// All bytes of a source, for readers that need them in memory. @throws Error beyond the budget.
[[nodiscard]] inline std::string read_all(ByteSource& source, ReadBudget& budget) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::string bytes;
  std::string block;
  for (bool is_whole = true; is_whole;) {
    is_whole = read_exactly(source, block, kBlock);
    budget.read_to(source.bytes_read());
    budget.require(bytes.size() + block.size());
    bytes += block;
  }
  return bytes;
}

}  // namespace torsio
