#pragma once

#include <cstddef>
#include <string>

namespace torsio {

/// What a piece of work would take of this machine's memory.
struct MemoryNeed {
  std::string what;  ///< "the matrix of all samples"
  double bytes = 0.0;
  std::size_t count = 0;     ///< of what it grows with; 0: no such number
  std::string counted = {};  ///< "samples"
  double growth = 1.0;       ///< bytes grow as count to this power
  std::string advice = {};   ///< "{}" stands for the count that fits
};

/// @throws Error with the count that fits if it is more than the machine has.
void require_memory(const MemoryNeed& need);

}  // namespace torsio
