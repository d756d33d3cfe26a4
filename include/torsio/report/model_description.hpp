#pragma once

#include <string>

#include "torsio/files/model_file.hpp"

namespace torsio {

/// What a model is, for a person: family, inputs with the range that it was trained on, target,
/// training files, held-out scores, and its numbers, as far as they can be read (a table of more
/// than 32 is named by its size).
[[nodiscard]] std::string model_description(const ModelFile& model);

/// The same for a machine: JSON with `family target unit inputs trained_on held_out metrics
/// parameters`.
[[nodiscard]] std::string model_description_json(const ModelFile& model);

}  // namespace torsio
