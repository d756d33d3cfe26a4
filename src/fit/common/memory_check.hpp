#pragma once

#include <cstddef>
#include <string>

namespace torsio {

/// The memory that a computation requires, to be compared with this machine's.
struct MemoryNeed {
  std::string what;  ///< "the matrix of all samples"
  double bytes = 0.0;
  std::size_t count = 0;     ///< the number that it grows with; 0: none
  std::string counted = {};  ///< "samples"
  double growth = 1.0;       ///< bytes grow as count to this power
  std::string advice = {};   ///< "{}" is replaced by the count that fits
};

/// @throws Error with the count that fits if it is more than the machine has.
void require_memory(const MemoryNeed& need);

}  // namespace torsio
