#pragma once

namespace torsio {

/// x^4: the second moment of area of a round section grows with it.
constexpr double fourth(double x) noexcept { return x * x * x * x; }

}  // namespace torsio
