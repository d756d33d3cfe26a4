#pragma once

#include <span>
#include <string>
#include <vector>

#include "export/c_inputs.hpp"
#include "export/c_text.hpp"
#include "signal/pipeline_listing.hpp"

namespace torsio {

/// Writes `NAME_reset_pipeline(state)` and `NAME_pipeline(state, raw, features)`.
/// @param slopes of the fallback, for the error that unknown states of `stop` and `dahl` cause
void write_pipeline(CText& c, const PipelineListing& listing, const std::vector<CInput>& inputs,
                    std::span<const double> slopes);

/// Whether a feature depends on a state that is unknown at the start: the program has `start_std_dev`.
[[nodiscard]] bool has_unknown_start(const PipelineListing& listing) noexcept;

}  // namespace torsio
