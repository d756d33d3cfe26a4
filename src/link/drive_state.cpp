#include "torsio/link/drive_state.hpp"

#include <utility>

namespace torsio {

void DriveState::initialised() noexcept {
  if (state_ != LinkDriveState::initialising) return;
  state_ = std::exchange(is_stop_pending_, false) ? LinkDriveState::stop : LinkDriveState::ready;
}

LinkRefusal DriveState::request(LinkStateCommand command, bool is_at_rest,
                                bool has_fault) noexcept {
  LinkDriveState next = LinkDriveState::ready;
  switch (command) {
    case LinkStateCommand::heartbeat:
    case LinkStateCommand::release: return LinkRefusal::none;
    case LinkStateCommand::enable:
      if (state_ != LinkDriveState::ready) return LinkRefusal::not_in_this_state;
      next = LinkDriveState::enabled;
      break;
    case LinkStateCommand::disable:
      if (state_ == LinkDriveState::ready) return LinkRefusal::none;
      if (state_ != LinkDriveState::enabled && !(state_ == LinkDriveState::stop && is_at_rest))
        return LinkRefusal::not_in_this_state;
      break;
    case LinkStateCommand::reset_fault:
      if (state_ != LinkDriveState::fault || has_fault) return LinkRefusal::not_in_this_state;
      next = std::exchange(is_stop_pending_, false) ? LinkDriveState::stop : LinkDriveState::ready;
      break;
  }
  state_ = next;
  return LinkRefusal::none;
}

bool DriveState::stop(LinkStateReason reason) noexcept {
  if (state_ == LinkDriveState::stop) return false;
  if (state_ == LinkDriveState::initialising || state_ == LinkDriveState::fault) {
    is_stop_pending_ = true;
    return false;
  }
  reason_ = reason;
  state_ = LinkDriveState::stop;
  return true;
}

bool DriveState::fault() noexcept {
  reason_ = LinkStateReason::joint_fault;
  return std::exchange(state_, LinkDriveState::fault) != LinkDriveState::fault;
}

}  // namespace torsio
