#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "joint_monitor.hpp"
#include "sim/campaign/duty_recording.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// What a monitor did while its joints worked without a fault.
struct FaultFreeOutcome {
  std::size_t ticks = 0;
  std::size_t watched_ticks = 0;
  std::size_t impacts = 0;
  std::map<std::string, std::size_t> alarms = {};  ///< by their cause
};

struct FaultFreeRun {
  std::vector<DataSheet> sheets;  ///< one per joint
  const JointMonitor& monitor;    ///< copied for each joint
  std::uint64_t seed = 1;         ///< seed of the first joint; the next joints have the next seeds
  DutySettings settings = {};
  std::size_t ticks = 0;
  bool is_electrical = false;
};

/// After a false alarm the monitor is reset and armed again.
[[nodiscard]] FaultFreeOutcome run_fault_free(const FaultFreeRun& run);

/// The joint with other inner friction of its second stage, by this factor.
[[nodiscard]] DataSheet with_hysteresis(const DataSheet& sheet, double factor);

}  // namespace torsio
