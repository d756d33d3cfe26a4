#pragma once

#include <functional>
#include <string_view>

namespace torsio {

/// Called by long work with its progress: a fraction in 0..1 and the current activity. It returns
/// false to ask the work to stop, which the work does by throwing `Cancelled`. An empty function:
/// progress is not reported.
using Progress = std::function<bool(double fraction, std::string_view doing)>;

}  // namespace torsio
