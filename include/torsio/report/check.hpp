#pragma once

#include <string>
#include <vector>

#include "torsio/check/advise/advice.hpp"
#include "torsio/check/check.hpp"

namespace torsio {

/// The most severe verdict; PASS if there are no findings.
[[nodiscard]] Verdict worst(const std::vector<Finding>& findings);

/// `{"verdict","findings":[{"verdict","check","recording","message","advice"}]}`, with advice also
/// `"advice":{"input","target","intended_use":{...},"proposals":[...],"regions":[...],
/// "learning_curve":[...],...,"limits":[...],"undetermined":[...]}`; ends with a line feed.
[[nodiscard]] std::string check_json(const std::vector<Finding>& findings,
                                     const Advice* advice = nullptr);

/// Intended use, proposals with their figures, the regions in a table, learning curve, limits, and
/// what cannot be determined.
[[nodiscard]] std::string advice_text(const Advice& advice);

}  // namespace torsio
