#pragma once

#include <cmath>
#include <cstddef>

#include "torsio/data/recording.hpp"

namespace torsio {

/// Whether a channel has a new, finite value at a sample.
inline bool is_measured(const Channel& channel, std::size_t sample) {
  return channel.is_fresh(sample) && std::isfinite(channel.values[sample]);
}

}  // namespace torsio
