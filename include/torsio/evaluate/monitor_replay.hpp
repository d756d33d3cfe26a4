#pragma once

#include <optional>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/estimate/monitored_torque.hpp"
#include "torsio/evaluate/estimate_recording.hpp"

namespace torsio {

/// What a monitor reports over a recording.
struct MonitorReplay {
  struct Finding : MonitorEvent {
    Fault fault = Fault::none;  ///< source_fault, source_lost: that of the source
  };
  /// A fault that the caller put into the recording.
  struct Injection {
    std::string fault;
    double start_s = 0.0;
  };

  /// The raw inputs, the combined torque ("estimated_torque_Nm") with its error bar, the torque of
  /// each source ("current_torque_Nm", NaN where it has a fault) with its fault ("current_fault_1",
  /// as `Fault`), and the state of the monitor (0 unproven, 1 ready, 2 watching, 3 stopped:
  /// "monitor_state_1").
  EstimatedRecording estimated;
  double watching_from_s = kNotMeasured;  ///< NaN: it was never ready
  double stopped_at_s = kNotMeasured;     ///< NaN: it did not stop
  /// Each finding at its begin, in the order of time; after the stop none.
  std::vector<Finding> events = {};
  std::vector<std::string>
      suspects;  ///< parts of which one fault explains the disagreement at the stop
  /// Why it was not ready before `watching_from_s`: each finding as it was last, with the time it
  /// was present, the longest one first.
  struct NotReady {
    Finding event;
    double present_s = 0.0;
  };
  std::vector<NotReady> not_ready = {};
  /// How long before that the error bars made a threshold larger than the one that may be armed.
  double threshold_too_large_s = 0.0;
  /// Given by the caller, for the report.
  std::vector<Injection> injections = {};
  /// How a simulated joint came to rest after the stop, given by the caller.
  struct Rest {
    double after_s = kNotMeasured;  ///< NaN: it was not at rest at the end
    double moved_rad = 0.0;         ///< from the stop to the end
  };
  std::optional<Rest> rest = {};
};

/// Streams the recording through sources, redundancy and monitor from `reset()`, as a loop would.
/// The monitor is armed as soon as it is ready.
/// @throws Error if a channel is missing or the recording has another sample rate; Cancelled.
[[nodiscard]] MonitorReplay replay_monitor(MonitoredTorque monitored, const Recording& recording,
                                           const Progress& progress = {});

}  // namespace torsio
