#pragma once

#include <cstddef>

#include "torsio/data/recording.hpp"

/// A recording in which samples that did not arrive are NaN in every channel, with the short gaps bridged.
struct BridgedRecording {
  torsio::Recording recording;
  std::size_t bridged = 0;  ///< samples
  std::size_t left = 0;     ///< samples that did not arrive and are still NaN
};

/// Gaps of at most `longest_s` between two samples that arrived are filled: by linear interpolation, and with the value before the
/// gap for channels without a unit (`_1`: states, modes, counters). An estimator does the same with its inputs
/// (`kLongestGapSeconds`). A channel that has no value at one of the two sides stays NaN.
[[nodiscard]] BridgedRecording bridge_lost_samples(const torsio::Recording& recording,
                                                   double longest_s);
