#pragma once

#include <sched.h>

#include "torsio/realtime/realtime_loop.hpp"

namespace torsio {

/// Asks the operating system for what a loop's thread should have, and gives the thread back as it
/// was. Locked memory stays locked: others may count on it by then.
class LoopPrivileges {
 public:
  /// @throws Error if something is refused that must be granted.
  explicit LoopPrivileges(const LoopOptions& options);
  ~LoopPrivileges();
  LoopPrivileges(const LoopPrivileges&) = delete;
  LoopPrivileges& operator=(const LoopPrivileges&) = delete;

  [[nodiscard]] const LoopGrants& grants() const noexcept { return grants_; }

 private:
  void ask_for(const LoopOptions& options);
  void give_back() noexcept;
  void note_refusal(const char* what, int code);

  LoopGrants grants_;
  int policy_ = SCHED_OTHER;
  sched_param parameters_{};
  cpu_set_t cpus_{};
};

/// Touches the stack that a step may use, so that no page of it is fetched while the loop runs.
void touch_stack() noexcept;

}  // namespace torsio
