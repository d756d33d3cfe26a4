#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "sim/faults/fault_rules.hpp"
#include "torsio/sim/closed_loop/tracking_score.hpp"

namespace torsio {
namespace {

/// The signals of a run that show its faults and its error.
class Signals {
 public:
  explicit Signals(const Recording& run)
      : run_(run),
        inverse_(run.channel("inverse_fault_1").values),
        loop_(run.channel("fault_1").values),
        wanted_Nm_(run.channel("wanted_torque_Nm").values),
        torque_Nm_(run.channel("truth_torque_Nm").values) {}

  [[nodiscard]] std::size_t size() const { return run_.size(); }
  [[nodiscard]] double time_s(std::size_t tick) const { return run_.time_s(tick); }
  [[nodiscard]] Fault fault(std::size_t tick) const {
    if (tick >= size()) return Fault::none;
    return static_cast<Fault>(
        static_cast<int>(inverse_[tick] != 0.0 ? inverse_[tick] : loop_[tick]));
  }
  /// Over the ticks [begin, end) without a reported fault.
  [[nodiscard]] std::optional<double> largest_unreported_error_Nm(std::size_t begin,
                                                                  std::size_t end) const {
    std::optional<double> largest;
    for (std::size_t tick = begin; tick < std::min(end, size()); ++tick)
      if (fault(tick) == Fault::none)
        largest = std::max(largest.value_or(0.0), std::abs(wanted_Nm_[tick] - torque_Nm_[tick]));
    return largest;
  }

 private:
  const Recording& run_;
  const std::vector<double>& inverse_;
  const std::vector<double>& loop_;
  const std::vector<double>& wanted_Nm_;
  const std::vector<double>& torque_Nm_;
};

std::string title(const ScheduledFault& fault, const DataSheet& sheet) {
  const FaultRule* const rule = find_fault_rule(fault.kind, common_part_name(fault.what, sheet));
  return rule == nullptr ? fault.what : fault.what + " " + std::string(rule->name);
}

}  // namespace

std::vector<FaultDetection> fault_detections(const FaultSchedule& schedule, const DataSheet& sheet,
                                             const Recording& run, const Recording& sound) {
  const Signals faulty(run);
  const Signals reference(sound);
  std::vector<FaultDetection> detections;
  for (const ScheduledFault& fault : schedule.faults) {
    FaultDetection detection{.what = title(fault, sheet), .start_s = fault.start_s};
    if (fault.duration_s) detection.end_s = fault.start_s + *fault.duration_s;
    const double end_s = detection.end_s.value_or(std::numeric_limits<double>::infinity());
    std::size_t begin = 0;
    while (begin < faulty.size() && faulty.time_s(begin) < fault.start_s) ++begin;
    if (begin == faulty.size()) continue;  // the loop was stopped before
    std::size_t end = begin;
    for (; end < faulty.size() && faulty.time_s(end) < end_s; ++end) {
      const Fault reported = faulty.fault(end);
      if (detection.detected_s || reported == Fault::none || reported == reference.fault(end))
        continue;
      detection.detected_s = faulty.time_s(end);
      detection.detected_as = reported;
    }
    detection.largest_unreported_error_Nm = faulty.largest_unreported_error_Nm(begin, end);
    detection.error_without_fault_Nm = reference.largest_unreported_error_Nm(begin, end);
    detections.push_back(std::move(detection));
  }
  return detections;
}

}  // namespace torsio
