#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fit/network/fit_network.hpp"
#include "fit/network/network_pass.hpp"

namespace torsio {

/// A stretch of one sequence.
struct SequencePart {
  std::size_t sequence = 0;
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Standardised samples, and where the windows on them start.
struct WindowSet {
  std::size_t steps = 1;
  std::size_t burn_in = 0;
  bool last_only = false;
  std::size_t inputs = 0;
  /// [samples x inputs], all sequences in series; of windows of one sample only those in the loss.
  std::vector<float> features = {};
  std::vector<float> targets = {};     ///< [samples]; 0 where not learned from
  std::vector<std::uint8_t> use = {};  ///< [samples]
  std::vector<std::size_t> starts = {};

  /// Puts some windows side by side.
  void fill(std::span<const std::size_t> windows, SequenceBatch& batch) const;
  /// Samples of a window that are in the loss.
  [[nodiscard]] std::size_t counted(std::size_t start) const;
};

/// The parts of the training data for training, and those that decide when to stop.
struct TrainingSplit {
  std::vector<SequencePart> training = {};
  std::vector<SequencePart> validation = {};  ///< may be empty
  std::string held_out = {};                  ///< in words
};

/// Every sequence whole.
[[nodiscard]] std::vector<SequencePart> whole_sequences(const TrainingData& data);

/// Holds out a fifth of the sequences that have a window, whole ones, by the seed; of a single one
/// its last fifth, `embargo` samples away from the rest.
[[nodiscard]] TrainingSplit split_for_validation(const TrainingData& data,
                                                 const TrainingWindows& windows,
                                                 std::size_t embargo, std::uint64_t seed);

/// Mean and standard deviation over the samples to learn from.
/// @throws Error if the target is constant, or not finite in such a sample.
[[nodiscard]] NetworkScaling scaling_of(const TrainingData& data,
                                        std::span<const SequencePart> parts);

/// The windows that have a sample in the loss: one every `stride` samples, and one that ends where
/// the data end.
[[nodiscard]] WindowSet make_windows(const TrainingData& data, std::span<const SequencePart> parts,
                                     const NetworkScaling& scaling, const TrainingWindows& windows);

/// The mean square error of a linear model of the samples in the loss, fitted to them.
[[nodiscard]] double linear_loss(const WindowSet& set);

}  // namespace torsio
