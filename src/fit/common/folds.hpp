#pragma once

#include <cstddef>

namespace torsio {

inline constexpr std::size_t kFolds = 5;

/// The fold of sample i of `count` in the order of recording: every fifth of 50 contiguous blocks.
/// A contiguous fold would be a range of the inputs that the other folds do not contain, and
/// extrapolation would choose the stiffest model.
[[nodiscard]] constexpr std::size_t interleaved_fold(std::size_t i, std::size_t count) {
  constexpr std::size_t kBlocksPerFold = 10;
  return i * kFolds * kBlocksPerFold / count % kFolds;
}

}  // namespace torsio
