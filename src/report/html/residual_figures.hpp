#pragma once

#include <vector>

#include "report/html/model_run.hpp"

namespace torsio {

/// Residuals of the first models of a recording over input, rate, torque and time, their distribution with
/// the claimed error bar, autocorrelation, spectrum, and the claimed against the found share of samples
/// within the error bar.
[[nodiscard]] std::vector<ReportFigure> residual_figures(const RecordRuns& record);

}  // namespace torsio
