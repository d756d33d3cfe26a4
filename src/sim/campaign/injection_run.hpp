#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "fault_classes.hpp"
#include "joint_monitor.hpp"
#include "torsio/actuator/data_sheet.hpp"

namespace torsio {

/// What became of one injection.
struct InjectionOutcome {
  enum class Kind : std::uint8_t {
    detected,
    missed,     ///< within a second of the onset
    unreached,  ///< the disagreement did not reach the limit in any attempt
    quiet,      ///< a fault that must not stop, and did not
    stopped,    ///< a fault that must not stop, and did
  };
  Kind kind = Kind::missed;
  int latency_ticks = 0;  ///< since the onset; 0 before it; of the loop's steps for an overrun
  int attempts = 1;
  int check = -1;  ///< `MonitorCheck` of the stop
  int brief =
      0;  ///< disagreements beyond the limit that ended by themselves, sooner than a stop may take
  bool near_impact = false;   ///< the onset is less than 100 ms after the beginning of an impact
  double disagreement = 0.0;  ///< the largest until the stop, over the rated torque
  double energy_gain =
      0.0;  ///< by stopping, over the energy in motion; NaN where it is not defined
};

/// Injections of one class, each into its own joint at work.
struct InjectionRun {
  const DataSheet& sheet;
  const JointMonitor& monitor;  ///< copied for each joint
  const FaultClass& fault;
  std::uint64_t seed = 1;  ///< seed of the class of this joint
  std::size_t first = 0;   ///< index of the first injection
  std::size_t count = 1;
  double limit_share =
      0.2;  ///< share of the rated torque: the disagreement from which latency counts
  /// Nominal size of all; 0: random, 0.25 to 1, and again with a larger one where the disagreement
  /// did not reach the limit.
  double size = 0.0;
  bool is_electrical = false;
};

[[nodiscard]] std::vector<InjectionOutcome> run_injections(const InjectionRun& run);

}  // namespace torsio
