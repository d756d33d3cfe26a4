#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "sim/arm/arm_bench.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/sim/arm/arm_run.hpp"

namespace torsio {

/// Compares the contacts that a controller finds with those that there are, tick by tick.
class ContactWatch {
 public:
  /// A tick before the arm moves on. @param is_pushed in the ticks that follow
  void see(const ArmController::Output& output, const ArmModel& arm, double time_s,
           bool is_pushed) {
    const bool is_true = is_pushed || plate_N_ > 0.0;
    if (is_true && !was_true_) began_s_ = is_pushed ? time_s : time_s - kArmTick_s;
    if (is_true) last_s_ = time_s;
    was_true_ = is_true;
    if (output.contact.is_found && !was_found_) {
      ArmContact contact{.found_s = time_s,
                         .joint = arm.joints[output.contact.joint].name,
                         .reaction = output.contact.reaction};
      // The observer still shows a contact shortly after it has ended.
      if (began_s_ && time_s - last_s_ < kMemory_s) contact.latency_s = time_s - *began_s_;
      contacts_.push_back(std::move(contact));
    }
    was_found_ = output.contact.is_found;
  }
  /// After the arm has moved on. @param force_N largest of the plate in the tick
  void measure(double force_N, double time_s) {
    plate_N_ = force_N;
    if (!impact_ && force_N > 0.0) impact_ = ArmImpact{.touched_s = time_s - kArmTick_s};
    if (!impact_) return;
    const double since_s = time_s - impact_->touched_s;
    if (force_N > impact_->peak_N) {
      impact_->peak_N = force_N;
      impact_->peak_after_s = since_s;
    }
    if (since_s <= kFirst_s) impact_->first_peak_N = std::max(impact_->first_peak_N, force_N);
    if (since_s > kLate_s)
      impact_->largest_late_N = std::max(impact_->largest_late_N.value_or(0.0), force_N);
    if (since_s >= kRest_s && !impact_->rest_N) impact_->rest_N = force_N;
  }
  void finish(ArmRun& run) && {
    run.contacts = std::move(contacts_);
    run.impact = impact_;
  }

 private:
  static constexpr double kMemory_s = 0.1;
  static constexpr double kFirst_s = 0.04;
  static constexpr double kLate_s = 0.08;
  static constexpr double kRest_s = 0.5;

  double plate_N_ = 0.0;
  bool was_true_ = false;
  bool was_found_ = false;
  std::optional<double> began_s_;
  double last_s_ = 0.0;
  std::vector<ArmContact> contacts_;
  std::optional<ArmImpact> impact_;
};

}  // namespace torsio
