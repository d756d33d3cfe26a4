#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// Fewer samples do not determine how one signal depends on another.
inline constexpr std::size_t kFewestSamples = 200;

/// `std::isfinite` as a function object for algorithms.
inline bool is_finite(double value) { return std::isfinite(value); }

/// The first input and the target of one recording, on the recording's clock.
struct Pair {
  std::vector<double> input;
  std::vector<double> target;  ///< interpolated linearly between new samples
};

struct Extent {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();
  void include(double value) {
    if (!std::isfinite(value)) return;
    lowest = std::min(lowest, value);
    highest = std::max(highest, value);
  }
  void include(const Extent& other) { include(other.lowest), include(other.highest); }
  [[nodiscard]] double width() const { return highest - lowest; }
};
[[nodiscard]] Extent extent_of(std::span<const double> values);

/// A channel at every sample, interpolated linearly between the samples that the sensor delivered:
/// a held value would seem delayed.
[[nodiscard]] std::vector<double> bridged(const Channel& channel);

[[nodiscard]] inline bool is_known(const Pair& pair, std::size_t i) {
  return is_finite(pair.input[i]) && is_finite(pair.target[i]);
}
/// Extents of input and target over the samples of [begin, end) at which both are finite.
[[nodiscard]] std::pair<Extent, Extent> known_extents(const Pair& pair, std::size_t begin,
                                                      std::size_t end);
[[nodiscard]] inline std::pair<Extent, Extent> known_extents(const Pair& pair) {
  return known_extents(pair, 0, pair.input.size());
}

/// Pearson's correlation over the samples where both are finite; 0 if one does not move.
[[nodiscard]] double correlation(const std::vector<double>& x, const std::vector<double>& y);

/// The finite values and their squared deviations from the mean.
struct Variation {
  double count = 0.0;
  double squares = 0.0;
};
[[nodiscard]] Variation variation_of(const std::vector<double>& values);

/// The highest step between two neighbouring samples, and the highest one elsewhere.
struct Jump {
  std::size_t sample = 0;  ///< the first after the step
  double height = 0.0;
  double next_height = 0.0;
};
[[nodiscard]] Jump largest_jump(const std::vector<double>& values);

/// A part over which a channel is constant.
struct Rest {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t length() const { return end - begin; }
  bool operator==(const Rest&) const = default;
};
/// Constant parts of at least `shortest` samples, the longest first.
[[nodiscard]] std::vector<Rest> rests_of(const Channel& channel, std::size_t shortest);

/// The share of new samples.
[[nodiscard]] double share_fresh(const Channel& channel);

/// The channel turns there: it leaves in the direction from which it came, by small steps. Friction
/// holds a joint while the torque reverses. A sensor that froze continues with a jump.
/// @param step_at_most the largest step with which it may leave
[[nodiscard]] bool is_turning_point(const Rest& rest, const std::vector<double>& values,
                                    double step_at_most);

/// The share of its range that a channel passes through meanwhile.
[[nodiscard]] double share_moved(const Channel& channel, const Rest& meanwhile);

/// Whether a stall while little moves is a fault: the channel is correlated with another one
/// everywhere else, and does not rest like that elsewhere, as a joint does that sticks at every
/// reversal.
/// @param rests of the channel, from half the length of `rest` on
[[nodiscard]] bool is_odd_one_out(const Rest& rest, const std::vector<Rest>& rests,
                                  const Channel& channel, const Channel& other);

/// Least squares through the samples where input and target are both finite.
struct Line {
  double mean_input = 0.0;
  double mean_target = 0.0;
  double slope = 0.0;
};
[[nodiscard]] Line line_through(const Pair& pair);

/// Lower and upper decile of the speeds while moving; empty if nothing moves.
[[nodiscard]] std::vector<double> typical_speeds(const std::vector<double>& differences);

/// Differences over the `half_window` samples before and after each: the motion without offset or
/// delay; NaN at both ends.
[[nodiscard]] std::vector<double> movement(const std::vector<double>& values,
                                           std::size_t half_window);

}  // namespace torsio
