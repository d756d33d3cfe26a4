#pragma once

#include <cstddef>

#include "torsio/model/any_model.hpp"

namespace torsio {

/// Whether an input cannot change the output of a model: all coefficients over it are exactly 0. Only a grey box shows
/// it; false for every other family.
[[nodiscard]] bool is_without_effect(const AnyModel& model, std::size_t input);

}  // namespace torsio
