#pragma once

#include <string>

#include "torsio/evaluate/slow_cycle.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

/// The description of a model as text: family, inputs with their range in training, target,
/// training files, mapping, held-out scores, its parameters (a table of more than 32 numbers is
/// given by its size), and what a slow cycle shows: stiffness, loop width, friction.
/// @param cycle `slow_cycle` of the model
[[nodiscard]] std::string model_description(const ModelFile& model, const SlowCycle& cycle);

/// The same as JSON with `family target sample_rate_Hz device_serial inputs trained_on mapping
/// options held_out metrics parameters slow_cycle`.
[[nodiscard]] std::string model_description_json(const ModelFile& model, const SlowCycle& cycle);

}  // namespace torsio
