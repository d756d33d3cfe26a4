#pragma once

#include <string>

#include "torsio/evaluate/adaptation.hpp"

namespace torsio {

/// `{"model","family","target","unit","method","outcomes":{...},"updates","roll_backs",
/// "covariance_resets","relative_change","as_it_ran":[{"recording","samples","frozen":{"rmse",...},
/// "adapted":{...}}],"held_out":[...]}`; ends with a line feed.
/// @param model the model file's name.
[[nodiscard]] std::string adaptation_json(const AdaptedModel& adapted, const std::string& model);

/// Frozen and adapted scores: on the recordings of the adaptation, as it ran, and on the held-out
/// samples; then the skipped samples with reasons.
[[nodiscard]] std::string adaptation_text(const AdaptedModel& adapted, const std::string& model);

}  // namespace torsio
