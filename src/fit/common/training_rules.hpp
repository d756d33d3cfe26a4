#pragma once

#include <string>
#include <vector>

#include "torsio/core/provenance.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/files/model_file.hpp"
#include "torsio/fit/common/training_data.hpp"

// The rules by which recordings are refused before a model is fitted. `train_model` applies them,
// and `check_dataset` reports the same errors as findings.

namespace torsio {

/// Values beyond this have squares whose sum over a recording overflows; the sum of squares of
/// smaller values than its inverse is 0.
inline constexpr double kLargestValue = 1e140;

/// The zeros of the training records: a model expects a channel zeroed or not, never both.
/// @throws Error naming the recordings that disagree.
[[nodiscard]] std::vector<ZeroRule> training_zeros(const Dataset& dataset);

/// The largest uncertainty of the target's sensor that a training record states, in each of its parts. None for
/// a target that was computed from a known load, which contains its own error.
[[nodiscard]] SensorUncertainty training_uncertainty(const Dataset& dataset);

/// What a user should know of it, and of statements on other channels, which have no effect.
[[nodiscard]] std::vector<std::string> uncertainty_notes(const Dataset& dataset);

/// Adds the sources of the records with the role train, each once.
void add_training_files(ModelCard& card, const Dataset& dataset);

/// @throws Error if the target or every input is constant over the usable samples, or if the target
/// or an input has values (or a range of values) that cannot be squared.
void require_trainable(const TrainingData& data);

/// @throws Error where the first input rests at a few levels, between which nothing was measured: neither
/// hysteresis nor the curve between the levels can be determined.
void require_motion(const TrainingData& data);

/// For a model with memory of which nothing could be held out.
[[noreturn]] void refuse_motion_without_return(const TrainingData& data);

/// The recordings of which no sample is usable, while others have some.
[[nodiscard]] std::vector<std::string> unused_recordings(const TrainingData& data);

}  // namespace torsio
