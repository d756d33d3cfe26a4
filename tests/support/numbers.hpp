#pragma once

#include <limits>

namespace torsio::test {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// The rate of a joint's loop, and of its recordings.
inline constexpr double kRate_Hz = 1000.0;

}  // namespace torsio::test
