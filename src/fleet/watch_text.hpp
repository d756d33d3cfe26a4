#pragma once

#include <string>
#include <vector>

#include "fleet/watch.hpp"
#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// The joints in their order, with the last comparison of each.
[[nodiscard]] std::string watch_text(const std::vector<WatchedJoint>& joints);
/// @param failures joints that could not be compared, with the reason
[[nodiscard]] std::string watch_json(const std::vector<WatchedJoint>& joints,
                                     const std::vector<std::string>& failures);
[[nodiscard]] ReportDocument watch_report(const std::vector<WatchedJoint>& joints);

}  // namespace torsio
