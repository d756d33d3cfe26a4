#pragma once

#include <string_view>

#include "torsio/core/progress.hpp"

namespace torsio {

/// Reports and throws `Cancelled` if the listener asks to stop.
void report_progress(const Progress& progress, double fraction, std::string_view doing);

}  // namespace torsio
