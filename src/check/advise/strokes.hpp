#pragma once

#include <cstddef>
#include <vector>

namespace torsio {

/// A motion of a signal from one reversal to the next: samples [begin, end). The strokes of a
/// recording follow each other without a gap.
struct Stroke {
  std::size_t begin = 0;
  std::size_t end = 0;
  double lowest = 0.0;
  double highest = 0.0;
  /// The frequency of the triangle wave that moves as fast as this stroke between 5 and 95 % of its
  /// travel: rests at its ends do not count.
  double frequency_Hz = 0.0;
  /// Time in the outer 5 % of the travel beyond that of a sine.
  double hold_s = 0.0;

  [[nodiscard]] double amplitude() const noexcept { return 0.5 * (highest - lowest); }
  [[nodiscard]] double centre() const noexcept { return 0.5 * (highest + lowest); }
  /// Mean speed while it moves.
  [[nodiscard]] double speed() const noexcept { return 4.0 * amplitude() * frequency_Hz; }
};

/// @param dead_band reversals by less are passed over: noise, the steps of an encoder. Samples that
/// are not finite belong to the stroke around them.
/// @returns one stroke for a signal that never reverses; empty if no sample is finite.
[[nodiscard]] std::vector<Stroke> strokes_of(const std::vector<double>& values, double dead_band,
                                             double sample_rate_Hz);

}  // namespace torsio
