#pragma once

#include <cstddef>
#include <string_view>

#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/model/any_model.hpp"

namespace torsio {

/// Whether an input cannot change the output of a model: all coefficients over it are exactly 0. Only a grey box shows
/// it, whose fit tried them; false for every other family. Those without terms over a rate need its guard.
[[nodiscard]] bool is_without_effect(const AnyModel& model, std::size_t input);

/// Why a model loses nothing without an input, as the rest of a sentence: "was constant in the training". Its range
/// guards all the same, because nothing is known of its effect beyond (docs/decisions/0027-beyond-the-range.md).
/// @returns empty where it is to be kept
[[nodiscard]] std::string_view reason_to_leave_out(const EstimatorSettings& settings,
                                                   const AnyModel& model, std::size_t input);

}  // namespace torsio
