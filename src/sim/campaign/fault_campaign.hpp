#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/estimate/monitored_torque.hpp"

namespace torsio {

/// A joint of a campaign and its monitor.
struct CampaignGroup {
  std::string name;  ///< "dfki-50"
  DataSheet sheet;   ///< the joint that works
  /// Called once; the joints get copies.
  std::function<MonitoredTorque()> monitor;
  /// What identifies the monitor, which `CampaignSettings::resume` requires: the hash of its file
  /// (`model_hash`), or `calibration_hash`.
  std::string monitor_hash = {};
};

struct CampaignSettings {
  std::uint64_t seed = 1;
  std::size_t injections = 300;           ///< count per class and group
  std::size_t injections_of_a_size = 60;  ///< count per smaller size, class and group
  double fault_free_hours = 1000.0;       ///< joints at work, all groups together
  /// Joints whose spring has another hysteresis than its model, by up to 25 %, under little load,
  /// all groups together (docs/simulation/faults.md 5).
  double low_load_hours = 70.0;
  std::vector<std::string> classes = {};  ///< only those whose name begins so; empty: all
  std::size_t threads = 0;                ///< 0: as many as the machine has
  /// Results are appended to this file, and those that are in it are not simulated again; empty:
  /// none.
  std::string resume = {};
  bool is_electrical = false;
};

struct Latencies {
  double p50_ms = kNotMeasured;
  double p99_ms = kNotMeasured;
  double longest_ms = kNotMeasured;
};

/// Injections of one class into one group. The disagreement of an injection is the largest
/// difference between two sources that the fault causes: what changes against a monitor with the
/// sound signals. It counts if it stays at `limit_share` of the rated torque or more for the
/// limit of its class (pauses of up to 5 ms included). A shorter one is counted as brief. Latencies
/// count from where it reaches that share, and are 0 if the monitor stopped before; for a signal
/// that is missing, not finite or wraps, and for the loop, from the injection. At power-up, only
/// joints count whose monitor would watch with the sound signals.
struct ClassResult {
  std::string name;
  std::string group = {};
  int row = 0;  ///< number in the table of docs/simulation/faults.md
  /// The disagreement that counts, over the rated torque: 0.2, or, in a joint with two sources,
  /// twice their threshold if that is more.
  double limit_share = 0.2;
  bool must_stop =
      true;  ///< false: a single spike; `detected` are stops, of which there must be none
  std::size_t injected = 0;
  std::size_t detected = 0;
  std::size_t late = 0;       ///< detected after `limit_ms`
  std::size_t redrawn = 0;    ///< attempts whose disagreement did not reach 20 % for so long
  std::size_t brief = 0;      ///< injections with brief disagreements before the stop or the miss
  std::size_t unreached = 0;  ///< not in `injected`: in no attempt
  double limit_ms = 0.0;
  double missed_upper_95 = 1.0;  ///< bound of the share that is missed
  Latencies latency = {};
  std::map<std::string, std::size_t> checks = {};  ///< which checks stopped, how often
  // With the onset in the 100 ms after the beginning of an impact.
  std::size_t near_impact = 0;
  std::size_t near_impact_detected = 0;
  Latencies near_impact_latency = {};
  // After a detection the power is removed and the brake closes.
  std::size_t stops = 0;
  std::size_t stops_with_gain = 0;     ///< more than 1e-3 of the energy in motion and springs
  double largest_gain = kNotMeasured;  ///< over that energy
};

/// How often disagreements around a size are detected.
struct SizeResult {
  std::string name;
  std::string group = {};
  double size = 0.0;  ///< middle of a range, over the rated torque
  std::size_t injected = 0;
  std::size_t detected = 0;
};

/// Joints without a fault.
struct FaultFreeResult {
  std::string group = {};
  bool is_low_load = false;  ///< other hysteresis of the spring, by up to 25 %, under little load
  double joint_hours = 0.0;  ///< during which the monitor watched
  double simulated_hours = 0.0;
  std::size_t false_alarms = 0;
  double upper_95 = kNotMeasured;  ///< bound of the false alarms per hour
  std::size_t impacts = 0;
  std::map<std::string, std::size_t> causes = {};  ///< "disagreement current spring"
};

struct CampaignResult {
  std::uint64_t seed = 1;
  std::vector<ClassResult> classes = {};
  std::vector<SizeResult> sizes = {};
  std::vector<FaultFreeResult> fault_free = {};
  FaultFreeResult work = {};  ///< all groups together
  FaultFreeResult low_load = {};
};

/// Injects random faults into simulated joints at work (`DutySettings`) and lets them work without
/// one. The result depends on settings and groups alone, not on the number of threads or
/// interruptions.
/// @throws UsageError for settings out of range or `resume` without a `monitor_hash`, Error if
/// `resume` belongs to another campaign, cannot be written, or if a monitor does not fit its joint;
/// Cancelled: what is done is in `resume`.
[[nodiscard]] CampaignResult run_fault_campaign(const std::vector<CampaignGroup>& groups,
                                                const CampaignSettings& settings,
                                                const Progress& progress = {});

/// The names of the classes that a group can have.
[[nodiscard]] std::vector<std::string> campaign_classes(const CampaignGroup& group);

}  // namespace torsio
