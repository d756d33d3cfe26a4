#pragma once

#include <string>
#include <vector>

#include "sim/campaign/fused_accuracy.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/evaluate/monitor_replay.hpp"
#include "torsio/report/text_table.hpp"

namespace torsio {

/// The limits of a calibrated monitor: a row for each pair of sources, and what they rest on.
[[nodiscard]] std::string calibration_text(const CalibratedMonitor& calibrated);
[[nodiscard]] std::string calibration_json(const CalibratedMonitor& calibrated);

/// What was found when, one line a finding, and a plot of the torques for a recording that stopped.
[[nodiscard]] std::string replays_text(const std::vector<MonitorReplay>& replays,
                                       const MonitorSettings& settings);
/// What the monitor reports of each recording.
[[nodiscard]] TextTable verdict_table(const std::vector<MonitorReplay>& replays);
/// Findings, reasons why it was not ready, and injected faults with their outcome: a row for each.
[[nodiscard]] TextTable finding_table(const std::vector<MonitorReplay>& replays,
                                      const MonitorSettings& settings);
[[nodiscard]] std::string replays_json(const std::vector<MonitorReplay>& replays,
                                       const MonitorSettings& settings);
/// One row per actuator: errors of the combined torque and of its sources.
[[nodiscard]] std::string accuracy_text(const std::vector<FusedAccuracy>& actuators);
[[nodiscard]] std::string accuracy_json(const std::vector<FusedAccuracy>& actuators);

}  // namespace torsio
