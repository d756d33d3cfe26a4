#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "torsio/data/recording.hpp"

namespace torsio {

/// Converts a recording to another sample rate. For offline use: the interpolation and the filter
/// use at most one future sample of the slower clock, and have no delay.
///
/// Upward: linear interpolation. Downward: the mean of the piecewise linear signal over one new
/// period around each new sample (a box filter, first zero at the new rate), shortened evenly at
/// both ends of the recording. Linear signals are exact in both cases. A channel with a freshness
/// mask is held, never interpolated, and a new sample is fresh if a fresh one arrived since the one
/// before. NaN makes every sample NaN that is computed from it.
/// @throws Error if the rate is not positive and finite, or would give no or too many samples.
[[nodiscard]] Recording resample(const Recording& recording, double sample_rate_Hz);

/// Samples that share a stamp, spread evenly up to the next stamp (the last ones as those before),
/// so that stamps coarser than the sampling give a time for each sample.
[[nodiscard]] std::vector<double> spread_within_stamps(std::span<const double> stamps_s);

/// Puts a channel of uneven stamps onto an even clock of so many samples: interpolated, or held if
/// it has a mask.
[[nodiscard]] Channel on_even_clock(const Channel& channel, std::span<const double> stamps_s,
                                    double sample_rate_Hz, std::size_t samples);

}  // namespace torsio
