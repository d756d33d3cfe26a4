#pragma once

#include <cstddef>
#include <vector>

#include "torsio/data/dataset.hpp"

namespace torsio {

/// How many samples have a role.
inline std::size_t samples_with_role(const std::vector<Segment>& segments, Role role) {
  std::size_t count = 0;
  for (const Segment& segment : segments)
    if (segment.role == role) count += segment.end - segment.begin;
  return count;
}

inline std::size_t samples_with_role(const Dataset& dataset, Role role) {
  std::size_t count = 0;
  for (const DatasetRecord& record : dataset.records)
    count += samples_with_role(record.segments, role);
  return count;
}

}  // namespace torsio
