#pragma once

#include "torsio/train/training_data.hpp"

namespace torsio {

/// Frequencies between which all but the lowest and the highest percent of the first input's power
/// lies, over all records (periodogram by the FFT, mean removed, Hann window).
struct ExcitedBand {
  double lowest_Hz = 0.0;
  double highest_Hz = 0.0;
};
[[nodiscard]] ExcitedBand excited_band(const TrainingData& data);

}  // namespace torsio
