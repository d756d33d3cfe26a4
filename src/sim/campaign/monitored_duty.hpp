#pragma once

#include "sim/campaign/duty_recording.hpp"
#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/evaluate/monitor_replay.hpp"

namespace torsio {

/// A simulated joint at work whose monitor acts on it (`duty_recording` with this guard and the truth
/// channels), and what the monitor reports: with the scheduled faults as `injections`, and after a stop
/// how the joint came to rest: its last angle that differs by more than 1 mrad from the final one, if
/// 0.05 s or more are left after it.
/// @throws as `duty_recording` and `replay_monitor`.
[[nodiscard]] MonitorReplay monitored_duty(const DataSheet& sheet, DutyRun work,
                                           const MonitoredTorque& monitor,
                                           const Progress& progress = {});

}  // namespace torsio
