#pragma once

#include <string>

#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// Frequencies between which all but the lowest and the highest percent of the first input's power
/// lies, over all records (periodogram by the FFT, mean removed, Hann window).
struct ExcitedBand {
  double lowest_Hz = 0.0;
  double highest_Hz = 0.0;
};
[[nodiscard]] ExcitedBand excited_band(const TrainingData& data);

/// A note on a relaxation at a rate more than an octave outside of the band: "below the 0.05 to 4
/// Hz that the records excite, which see only its tail"; else nothing.
[[nodiscard]] std::string outside_of(const ExcitedBand& band, double rate_1_s);

}  // namespace torsio
