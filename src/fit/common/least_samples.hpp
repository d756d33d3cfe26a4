#pragma once

#include <cstddef>
#include <string>

#include "torsio/core/error.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// With fewer samples, spreads and errors of a flexible model are meaningless.
inline constexpr std::size_t kLeastSamples = 10;
/// What `grey_box` needs, the model that most recordings are for.
inline constexpr std::size_t kLeastGreyBoxSamples = 200;

/// @throws Error if there are fewer usable samples.
inline void require_samples(const TrainingData& data) {
  if (data.usable_samples() >= kLeastSamples) return;
  throw Error({.problem = "too few training samples",
               .expected = "at least " + std::to_string(kLeastSamples),
               .found = std::to_string(data.usable_samples())});
}

}  // namespace torsio
