#pragma once

#include <string_view>

#include "export/c_text.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// The families that `write_model` can write, separated by commas.
[[nodiscard]] std::string_view exported_families() noexcept;

/// Writes `NAME_reset_model(state)` and `NAME_model(state, x)`, the estimate of the model alone.
/// @throws UsageError for another family.
void write_model(CText& c, const AnyModel::Parameters& parameters, bool is_inverted = false);

}  // namespace torsio
