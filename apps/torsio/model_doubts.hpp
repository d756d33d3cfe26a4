#pragma once

#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"

/// Warns of recordings that the model was trained on: a score on them is no held-out one.
void warn_of_seen_recordings(const torsio::ModelFile& file, const torsio::Dataset& dataset);
/// Warns of channels that the model expects with their zero taken, but a recording has as measured.
void warn_of_missing_zeros(const torsio::ModelFile& file, const torsio::Dataset& dataset);
/// Warns of recordings whose torque over the first input differs from the training data's by a unit.
void warn_of_another_unit(const torsio::ModelFile& file, const torsio::Dataset& dataset);
