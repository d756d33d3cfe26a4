#pragma once

#include <limits>

namespace torsio {

/// A value that was not measured: it becomes a fault where it is used, never a guess.
inline constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

}  // namespace torsio
