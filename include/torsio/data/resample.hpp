#pragma once

#include "torsio/data/recording.hpp"

namespace torsio {

/// Brings a recording to another sample rate. For offline use: both ways look ahead by at most one
/// sample of the slower clock, and delay nothing.
///
/// Upward: linear interpolation. Downward: the mean of the piecewise linear signal over one new
/// period around each new sample (a box filter, first zero at the new rate), shortened evenly at
/// both ends of the record. Straight lines stay exact either way. A channel with a freshness mask
/// is held, never interpolated, and a new sample is fresh if a fresh one arrived since the one
/// before. NaN spreads to every sample that it takes part in.
/// @throws Error if the rate is not positive and finite, or would give no or too many samples.
[[nodiscard]] Recording resample(const Recording& recording, double sample_rate_Hz);

}  // namespace torsio
