#pragma once

#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/check/check.hpp"
#include "torsio/control/model_inverse.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/files/model_file.hpp"

/// Repeats what `torsio check` reports as FAIL about these recordings, one line each.
void warn_of_failed_checks(const torsio::FitCheck& check);
void warn_of_failed_checks(const torsio::Dataset& dataset, const torsio::FeatureSpec& features);
/// Warnings of held-out recordings whose motion is of another kind than that of every training
/// recording (`other_motions`), and does not lie between them.
/// @param place the fold that holds them out, "fold 2: "; may be empty
[[nodiscard]] std::vector<std::string> other_motion_warnings(const torsio::Dataset& dataset,
                                                             const torsio::FeatureSpec& features,
                                                             const std::string& place = {});
/// Prints them.
void warn_of_other_motions(const torsio::Dataset& dataset, const torsio::FeatureSpec& features,
                           const std::string& place = {});
/// Warns of recordings that the model was trained on: a score on them is not a held-out score.
void warn_of_seen_recordings(const torsio::ModelFile& file, const torsio::Dataset& dataset);
/// Warns of channels that the model expects with their zero removed, but a recording has as
/// measured.
void warn_of_missing_zeros(const torsio::ModelFile& file, const torsio::Dataset& dataset);
/// Warns of recordings whose torque over the first input differs from that of the training data by
/// the factor between two units.
void warn_of_another_unit(const torsio::ModelFile& file, const torsio::Dataset& dataset);
/// Warns of an inverse whose deflection for `torque_Nm` or for 0 Nm at rest is far from that of the
/// actuator's linear model: the model was trained on another spring, or with other zeros of its encoders.
void warn_of_another_spring(const std::string& model, torsio::AnyInverse inverse,
                            const torsio::LinearInverse& line, const torsio::DataSheet& sheet,
                            double torque_Nm);
