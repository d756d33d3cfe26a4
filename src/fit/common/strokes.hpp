#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Turning back by at most this much of the first input is part of a stroke.
[[nodiscard]] double stroke_dead_band(const TrainingData& data);

/// The duration of a stroke (`detail::StrokeClock::longest`) that it does not exceed in 99 % of the usable samples [s].
[[nodiscard]] double longest_stroke_s(const TrainingData& data);

/// The strokes of the first input, grouped by how long they last, so that one group can be predicted from the others.
struct StrokeKinds {
  /// By sequence and sample, the group: 0 has the shortest strokes.
  std::vector<std::vector<std::uint8_t>> kinds = {};
  std::size_t count = 1;  ///< 1: the strokes last about equally long
  /// n = (r - 1)^2 / r, with r the duration over the longest one of the other groups: root mean square over the samples
  /// in the last group.
  double novelty = 0.0;
};
[[nodiscard]] StrokeKinds stroke_kinds(const TrainingData& data);

}  // namespace torsio
