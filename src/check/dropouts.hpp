#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "check/signal_pair.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Bursts in which a channel has one value instead of its measurements: a bus that lost its frames.
struct Dropouts {
  bool is_one_value = false;  ///< all bursts have the same value; else each holds the last one
  double value = 0.0;         ///< where they have the same
  std::size_t shortest = 0;   ///< samples
  std::size_t longest = 0;
  double highest_jump = 0.0;
  std::vector<Rest> bursts;
};
/// At least two bursts of four or more equal new samples, in less than half of the recording. Either all have exactly
/// one value, and the channel jumps to it or back, at least once both; or the channel, which has noise and nearly no two equal neighbours elsewhere,
/// holds its last value and then jumps to the measured one. A jump is above `least` and five times the steps of 99 % of
/// the samples. A channel that jumps to a value and rests there, such as a command, jumps from a rest.
[[nodiscard]] std::optional<Dropouts> find_dropouts(const Channel& channel, double least);

/// Steps between neighbouring values that are far above all others: slips, steps of a zero.
struct Jumps {
  std::vector<std::size_t> samples;  ///< the first after each step, in the order of time
  double lowest = 0.0;
  double highest = 0.0;
  double next_height = 0.0;  ///< the highest step elsewhere
};
/// Two to twelve places, each by `times` of what is passed through anywhere else, within two samples. One is found by `largest_jump`.
/// @param code resolution of the values: steps of few codes are none
[[nodiscard]] std::optional<Jumps> find_jumps(const std::vector<double>& values, double code,
                                              double times);

}  // namespace torsio
