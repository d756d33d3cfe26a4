#pragma once

#include <cstddef>
#include <vector>

#include "torsio/core/matrix.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/training_data.hpp"

namespace torsio {

/// A model's free run over a recording of the target that it estimates.
struct ComparedRun {
  std::vector<double> x;  ///< first input of the model; held where it is not finite
  Matrix features;
  std::vector<double> output;
  std::vector<std::size_t> rows;  ///< samples that are compared: measured, without a fault
  const Channel* target = nullptr;
  const Recording* recording = nullptr;
  std::size_t outside = 0;  ///< samples with a fault of the model
};

/// Fewest samples from which a change is estimated.
inline constexpr std::size_t kLeastDriftSamples = 200;

/// In how many compared samples 5 ms pass, at least 1: the noise of a load cell after a filter of 100 Hz or more
/// has no memory of that length, a motion has.
[[nodiscard]] std::size_t noise_lag(const ComparedRun& run) noexcept;

/// @throws Error if the recording is shorter than 5 s.
void require_length(const Recording& recording);

/// @param sequence the features of the recording for the model.
/// @throws Error if more than half of the samples have a fault, fewer than `kLeastDriftSamples` are left, or
/// the target cannot be that of the model (`require_plausible_reference`).
[[nodiscard]] ComparedRun compared_run(const ModelFile& model, const DatasetRecord& record,
                                       const Dataset& dataset, Sequence sequence);

}  // namespace torsio
