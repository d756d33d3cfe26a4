#pragma once

#include <cmath>

#include "torsio/core/estimate.hpp"

namespace torsio::detail {

/// Whether a source may be used: it reports no fault, and its value and error bar are numbers.
inline bool is_valid(const Estimate& source) noexcept {
  return source.fault == Fault::none && std::isfinite(source.value) && source.std_dev > 0.0 &&
         std::isfinite(source.std_dev);
}

}  // namespace torsio::detail
