#pragma once

#include <string>

#include "torsio/sim/closed_loop/impedance_tracking.hpp"

namespace torsio {

/// The task with its gains, a table of wanted and rendered impedance over the frequency, and the
/// forces of the hand.
[[nodiscard]] std::string impedance_text(const ImpedanceRun& run);

/// The same as a JSON object; ends with a line feed.
[[nodiscard]] std::string impedance_json(const ImpedanceRun& run);

}  // namespace torsio
