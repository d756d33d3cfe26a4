#pragma once

#include <cstdint>

#include "torsio/core/realtime.hpp"
#include "torsio/link/link_enumerations.hpp"

namespace torsio {

/// State of the drive of a joint:
///
///     initialising --initialised--> ready --enable--> enabled --disable--> ready
///     initialising, ready, enabled --stop, host lost or released, clock--> stop --disable, at rest--> ready
///     any --fault--> fault --reset_fault, cause ended--> ready
///
/// A stop is latched, also in a joint that was not enabled: an enable that arrives after it has no effect. While the joint
/// initialises, and in a fault, a stop takes effect at the end. States and commands of CiA 402: docs/robot/link.md.
class DriveState {
 public:
  [[nodiscard]] LinkDriveState state() const noexcept { return state_; }
  /// The cause of the last fault or stop.
  [[nodiscard]] LinkStateReason reason() const noexcept { return reason_; }
  [[nodiscard]] bool is_enabled() const noexcept { return state_ == LinkDriveState::enabled; }
  /// Neither moving nor stopping: parameters of the drive may change.
  [[nodiscard]] bool is_disabled() const noexcept {
    return state_ != LinkDriveState::enabled && state_ != LinkDriveState::stop;
  }

  /// The joint has its measurements, and its checks have passed.
  void initialised() noexcept TORSIO_REALTIME;
  /// Enables, disables or resets a fault. Other commands of a host (`heartbeat`, `release`) change no state.
  /// @param is_at_rest the drive does not move: a stop ends only then
  /// @param has_fault the cause of a fault is still there
  /// @returns `none`, or `not_in_this_state`
  [[nodiscard]] LinkRefusal request(LinkStateCommand command, bool is_at_rest,
                                    bool has_fault) noexcept TORSIO_REALTIME;
  /// @returns whether the state has changed
  bool stop(LinkStateReason reason) noexcept TORSIO_REALTIME;
  /// @returns whether the state has changed
  bool fault() noexcept TORSIO_REALTIME;

 private:
  LinkDriveState state_ = LinkDriveState::initialising;
  LinkStateReason reason_ = LinkStateReason::none;
  bool is_stop_pending_ = false;
};

}  // namespace torsio
