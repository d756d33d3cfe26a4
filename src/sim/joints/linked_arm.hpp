#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sim/arm/arm_bench.hpp"
#include "sim/joints/linked_joint.hpp"
#include "torsio/arm/arm_controller.hpp"
#include "torsio/sim/joints/joint_server.hpp"

namespace torsio {

/// A simulated arm whose joints are driven over the link, each by itself: in the mode `ArmMode::joints`.
///
/// Its brakes open when every joint was enabled; until then an enabled joint refuses references. A stop, a fault or a disable of
/// one joint stops all of them; they can be enabled again when all are at rest and every joint was disabled.
class LinkedArm {
 public:
  /// @param has_gear_stage as `JointServer::Settings`; a clutch is always one that slips
  /// @throws Error as `ArmBench` and `arm_controller_settings`.
  LinkedArm(ServedArm arm, bool has_gear_stage, std::uint64_t seed);
  LinkedArm(const LinkedArm&) = delete;
  LinkedArm& operator=(const LinkedArm&) = delete;

  // A tick: sense, then what arrives over the link, then control.

  void sense() noexcept TORSIO_REALTIME;
  void control() noexcept TORSIO_REALTIME;

  [[nodiscard]] std::size_t size() const noexcept { return joints_.size(); }
  [[nodiscard]] LinkedJoint& joint(std::size_t index) noexcept { return *joints_[index]; }
  [[nodiscard]] const ArmSetup& setup() const noexcept { return arm_.setup; }

  // For its joints.

  /// Opens the brakes as soon as all joints are enabled. @returns whether an enable is possible now
  [[nodiscard]] bool may_enable() const noexcept TORSIO_REALTIME;
  void enabled() noexcept TORSIO_REALTIME;
  void disabled() noexcept TORSIO_REALTIME;
  void stop(StopCategory category) noexcept TORSIO_REALTIME;
  /// Why all joints have to stop; `none`: they have not.
  [[nodiscard]] LinkStateReason stop_reason() const noexcept { return stop_reason_; }
  [[nodiscard]] bool is_at_rest() const noexcept { return output().is_at_rest; }
  /// At rest, without power and with its brakes.
  [[nodiscard]] bool is_off() const noexcept;
  /// The brakes open or are open: references are accepted.
  [[nodiscard]] bool is_running() const noexcept {
    return is_started_ && !is_release_wanted_ && output().cause == ArmStopCause::none;
  }
  [[nodiscard]] bool is_sensed() const noexcept { return output_ != &kNoOutput; }
  [[nodiscard]] const ArmController::Output& output() const noexcept { return *output_; }
  [[nodiscard]] const JointSample& sample(std::size_t joint) const noexcept {
    return samples_[joint];
  }
  [[nodiscard]] ArmBench& bench() noexcept { return bench_; }
  [[nodiscard]] const ArmBench& bench() const noexcept { return bench_; }
  [[nodiscard]] ArmController& controller() noexcept { return controller_; }
  /// After a change of the zeros: filters begin again. The arm is stopped.
  void restart_filters() noexcept TORSIO_REALTIME { controller_.reset(); }

 private:
  /// @param arm is moved from
  LinkedArm(ServedArm& arm, const ArmController::Settings& settings, FirstStageForm form,
            std::uint64_t seed);
  void open_brakes() noexcept;
  void find_faults() noexcept;
  void end_stop() noexcept;
  void act() noexcept;

  ServedArm arm_;
  ArmBench bench_;
  ArmController controller_;
  std::vector<std::unique_ptr<LinkedJoint>> joints_ = {};
  std::vector<JointSample> samples_;
  std::vector<ArmBench::Command> commands_;
  ArmReference wanted_ = {.mode = ArmMode::joints};
  static inline const ArmController::Output kNoOutput = {};
  const ArmController::Output* output_ = &kNoOutput;  ///< before the first step
  ArmStopCause last_cause_ = ArmStopCause::requested;
  LinkStateReason stop_reason_ = LinkStateReason::none;
  bool is_started_ = false;         ///< every joint was enabled, and none has stopped since
  bool is_release_wanted_ = false;  ///< the brakes have not been permitted to open yet
  std::uint32_t release_ticks_ = 0;
  bool is_broken_ = false;  ///< the simulation has refused a step
};

}  // namespace torsio
