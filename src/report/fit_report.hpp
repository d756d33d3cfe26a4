#pragma once

#include <string>

#include "torsio/evaluate/fit_report.hpp"
#include "torsio/evaluate/results.hpp"

namespace torsio {

/// The report of a fit as text: correlations of the residuals, the parameters
/// with standard errors (if the family names them).
[[nodiscard]] std::string fit_report_text(const FitReport& report);

/// `results_json` of the fitted model's scores with `fit_report` and `notes` beside the results.
[[nodiscard]] std::string fit_json(const Results& results, const FitReport& report,
                                   const std::vector<std::string>& notes);

}  // namespace torsio
