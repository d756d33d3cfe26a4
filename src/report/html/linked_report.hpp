#pragma once

#include <map>
#include <string>

#include "torsio/report/document/report_document.hpp"

namespace torsio {

/// As `report_html`. The first cell of a row is a link if it is a key of `pages`, to the file of that name beside the
/// page.
[[nodiscard]] std::string linked_report_html(const ReportDocument& document,
                                             const std::map<std::string, std::string>& pages);

}  // namespace torsio
