#pragma once

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/evaluate/drift.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// How a joint differs from another one of its type, by a model of the other one: as `detect_drift`, with two further
/// directions, since sound joints of a type differ in them and a single joint hardly changes in them:
///
///     a |E|   the stiffness is (1 + s + a) times that of the model for E > 0, (1 + s - a) times for E < 0
///     w W     H with thresholds twice as large, less H: other break-away angles
///
/// Without them, asymmetry is taken for stiffness, zero and backlash. The quantities are those of `detect_drift`,
/// "asymmetry", which is a, and "break-away angles", which is w: they are 2^w times those of the model. There is no
/// reference.
/// @throws as `detect_drift`.
[[nodiscard]] Drift joint_difference(const ModelFile& model, const Dataset& dataset,
                                     const DriftOptions& options = {},
                                     const Progress& progress = {});

}  // namespace torsio
