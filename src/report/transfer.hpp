#pragma once

#include <string>

#include "torsio/evaluate/transfer_curve.hpp"

namespace torsio {

/// The methods with their maps and errors, and whether the base helps.
/// @param curve may have no points
[[nodiscard]] std::string transfer_text(const TransferEvaluation& evaluation,
                                        const TransferCurve& curve, const std::string& target);

/// `{"target","unit","seconds","chosen","methods":[{"method","held_out_rmse","rmse","std_abs","guarded_share",
/// "input_scale","gain","offset"}],"curve":[...],"base_helps_until_s","notes"}`; ends with a line feed.
[[nodiscard]] std::string transfer_json(const TransferEvaluation& evaluation,
                                        const TransferCurve& curve, const std::string& target);

}  // namespace torsio
