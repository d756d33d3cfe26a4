#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "torsio/safety/monitor.hpp"

namespace torsio::detail {

/// @throws Error if a name, an index or a limit is not valid.
void check(const MonitorSettings& settings);

/// The place of the signal with which each one moves; its own place if there is none.
/// @throws Error if there is no such signal.
[[nodiscard]] std::array<std::uint8_t, Monitor::kMaxSignals> companions(
    const std::vector<MonitoredSignal>& signals);

}  // namespace torsio::detail
