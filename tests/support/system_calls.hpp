#pragma once

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstddef>

namespace torsio::test {

/// From here on any system call of this thread kills the process with SIGSYS, but for reading a
/// clock, sleeping on it, and `_exit`. Other threads go on as before.
/// @returns false if the kernel does not take the filter
inline bool allow_only_clock_calls() {
  constexpr auto kAllowed = std::to_array<unsigned>(
      {SYS_clock_gettime, SYS_clock_nanosleep, SYS_exit_group, SYS_rt_sigreturn});
  constexpr auto kNumber = static_cast<unsigned>(offsetof(seccomp_data, nr));
  std::array<sock_filter, kAllowed.size() + 3> program{};
  program[0] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kNumber);
  for (std::size_t n = 0; n < kAllowed.size(); ++n) {
    const auto to_the_end = static_cast<unsigned char>(kAllowed.size() - n);
    program[n + 1] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kAllowed[n], to_the_end, 0);
  }
  program[kAllowed.size() + 1] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
  program[kAllowed.size() + 2] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  const sock_fprog filter{.len = static_cast<unsigned short>(program.size()),
                          .filter = program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

}  // namespace torsio::test
