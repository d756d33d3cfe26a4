#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "torsio/core/estimate.hpp"

namespace torsio {

/// The value at `share` (0 to 1) of the sorted values, the lower neighbour; NaN of none.
[[nodiscard]] inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return kNotMeasured;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

}  // namespace torsio
