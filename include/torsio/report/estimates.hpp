#pragma once

#include <string>
#include <vector>

#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/evaluate/estimate_recording.hpp"

namespace torsio {

/// A table with a row for each recording: samples, share of each fault, range of the estimate and
/// largest error bar. A last line names the recordings in which more than a tenth of the samples
/// have a fault.
[[nodiscard]] std::string estimates_text(const std::vector<EstimateSummary>& summaries,
                                         const EstimatorSettings& settings);

/// The same as a JSON object; ends with a line feed.
[[nodiscard]] std::string estimates_json(const std::vector<EstimateSummary>& summaries,
                                         const EstimatorSettings& settings);

}  // namespace torsio
