#include "sim/campaign/monitored_duty.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace torsio {
namespace {

/// The joint is at rest from its last larger motion on.
MonitorReplay::Rest rest_after(const Recording& recording, double stop_s) {
  constexpr double kStill_rad = 1e-3;
  const std::vector<double>& angle = recording.channel("truth_joint_angle_rad").values;
  const auto stop = std::min(
      static_cast<std::size_t>(std::lround(stop_s * recording.sample_rate_Hz())), angle.size() - 1);
  std::size_t last = stop;
  for (std::size_t n = stop; n < angle.size(); ++n)
    if (std::abs(angle[n] - angle.back()) > kStill_rad) last = n;
  MonitorReplay::Rest rest{.moved_rad = std::abs(angle.back() - angle[stop])};
  constexpr double kLeastRest_s = 0.05;
  const double after_s = static_cast<double>(last - stop) / recording.sample_rate_Hz();
  if (static_cast<double>(angle.size() - last) > kLeastRest_s * recording.sample_rate_Hz())
    rest.after_s = after_s;
  return rest;
}

}  // namespace

MonitorReplay monitored_duty(const DataSheet& sheet, DutyRun work, const MonitoredTorque& monitor,
                             const Progress& progress) {
  work.guard = &monitor;
  work.with_truth = true;
  const Recording recording = duty_recording(sheet, work, progress);
  MonitorReplay replay = replay_monitor(monitor, recording, progress);
  for (const ScheduledFault& fault : work.faults.faults)
    replay.injections.push_back(
        {.fault = fmt::format("{} ({})", fault.what, fault.place), .start_s = fault.start_s});
  if (!std::isnan(replay.stopped_at_s)) replay.rest = rest_after(recording, replay.stopped_at_s);
  return replay;
}

}  // namespace torsio
