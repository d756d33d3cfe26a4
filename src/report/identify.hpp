#pragma once

#include <string>
#include <vector>

#include "torsio/identify/drive/identify_drive.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {

/// The errors of a drive that was only evaluated.
[[nodiscard]] std::string drive_evaluation_text(const DriveIdentification& evaluated);
/// Findings, parameters with standard errors, and the errors of the free runs.
[[nodiscard]] std::string identification_text(const DriveIdentification& identified);
/// `identified_drive_text` with the advice, as a document of the program.
[[nodiscard]] std::string identification_json(const DriveIdentification& identified,
                                              const std::vector<DriveAdvice>& advice);

/// Whether it is known which parameters are determined.
[[nodiscard]] bool has_standard_errors(const DriveIdentification& identified);
/// Each parameter with its standard error, its interval and what it is.
[[nodiscard]] TextTable drive_parameter_table(const DriveIdentification& identified);
/// The errors of the free runs, one row for each recording and one for the mean.
[[nodiscard]] TextTable drive_score_table(const DriveIdentification& identified);

/// The recordings to make next.
[[nodiscard]] TextTable drive_advice_table(const std::vector<DriveAdvice>& advice);
[[nodiscard]] std::string drive_advice_text(const std::vector<DriveAdvice>& advice);

}  // namespace torsio
