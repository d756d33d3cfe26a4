#pragma once

#include <string>
#include <string_view>

#include "torsio/files/model_file.hpp"

namespace torsio {

/// The card as JSON text: everything in a model file except the tensors.
[[nodiscard]] std::string card_json(const ModelFile& model);

/// The reverse. The model comes back with empty parameters of its family and without guards: those
/// are tensors.
/// @throws Error at `place` naming the entry that is missing or of the wrong kind.
[[nodiscard]] ModelFile model_of_card(std::string_view text, const std::string& place);

}  // namespace torsio
