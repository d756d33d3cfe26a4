#pragma once

#include <string>

#include "torsio/files/model_file.hpp"

namespace torsio {

/// The description of a model as text: family, inputs with their range in training, target,
/// training files, held-out scores, and its parameters (a table of more
/// than 32 numbers is given by its size).
[[nodiscard]] std::string model_description(const ModelFile& model);

/// The same as JSON with `family target unit inputs trained_on held_out metrics
/// parameters`.
[[nodiscard]] std::string model_description_json(const ModelFile& model);

}  // namespace torsio
