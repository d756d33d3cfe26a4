#pragma once

#include <string>
#include <vector>

#include "torsio/check/advise/advice.hpp"
#include "torsio/check/check.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The most severe verdict; PASS if there are no findings.
[[nodiscard]] Verdict worst(const std::vector<Finding>& findings);

/// `{"verdict","findings":[{"verdict","check","recording","message","advice"}]}`, with advice also
/// `"advice":{"input","target","intended_use":{...},"proposals":[...],"regions":[...],
/// "learning_curve":[...],...,"limits":[...],"undetermined":[...]}`, with that on a drive also
/// `"drive_advice":[{"recording","parameter","standard_error_ratio"}]`; ends with a line feed.
[[nodiscard]] std::string check_json(const std::vector<Finding>& findings,
                                     const Advice* advice = nullptr,
                                     const std::vector<DriveAdvice>& drive_advice = {});

/// Intended use, proposals with their figures, the regions in a table, learning curve, limits, and
/// what cannot be determined.
[[nodiscard]] std::string advice_text(const Advice& advice);

}  // namespace torsio
