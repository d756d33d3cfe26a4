#pragma once

#include <string>

#include "torsio/report/results.hpp"

namespace torsio {

/// The ranked tables of every held-out split as one page without external files. All names in it
/// are escaped.
[[nodiscard]] std::string results_html(const Results& results);

}  // namespace torsio
