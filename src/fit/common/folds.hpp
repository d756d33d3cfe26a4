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

/// Whether sample i is in the first or last twentieth of its block of `interleaved_fold`: what a trial
/// leaves out there, it has not seen almost the same of.
[[nodiscard]] constexpr bool is_next_to_border(std::size_t i, std::size_t count) {
  constexpr std::size_t kBlocks = kFolds * 10;
  constexpr std::size_t kShare = 20;
  const std::size_t within = i * kBlocks % count;
  return within * kShare < count || (count - within) * kShare <= count;
}

}  // namespace torsio
