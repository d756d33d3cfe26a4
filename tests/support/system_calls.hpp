#pragma once

#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <cstring>
#include <string>

#include "support/allocation_counter.hpp"
#include "support/lock_counter.hpp"

namespace torsio::test {

/// From here on any other system call of this thread kills the process with SIGSYS. Other threads
/// continue as before.
/// @returns false if the kernel does not take the filter
template <std::size_t kCount>
bool allow_only(const std::array<unsigned, kCount>& allowed) {
  constexpr auto kNumber = static_cast<unsigned>(offsetof(seccomp_data, nr));
  std::array<sock_filter, kCount + 3> program{};
  program[0] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kNumber);
  for (std::size_t n = 0; n < kCount; ++n) {
    const auto to_the_end = static_cast<unsigned char>(kCount - n);
    program[n + 1] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, allowed[n], to_the_end, 0);
  }
  program[kCount + 1] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
  program[kCount + 2] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  const sock_fprog filter{.len = static_cast<unsigned short>(program.size()),
                          .filter = program.data()};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) == 0;
}

/// Reading a clock, sleeping on it, and `_exit`.
inline bool allow_only_clock_calls() {
  return allow_only(std::to_array<unsigned>(
      {SYS_clock_gettime, SYS_clock_nanosleep, SYS_exit_group, SYS_rt_sigreturn}));
}

/// `_exit`: who blocks, sleeps, reads or writes is killed.
inline bool allow_no_calls() { return allow_only(std::to_array<unsigned>({SYS_exit_group})); }

/// What a separate process calls in `work()` besides computing: "" if it calls neither the heap,
/// nor a lock, nor the kernel, and `work` returns true. Also "" if the kernel takes no filter
/// (which `SystemCalls.AreSeenByTheKernelsFilter` reports).
template <class Work>
std::string besides_computing(Work&& work) {
  enum Found : int { nothing, heap, locks, wrong };
  const pid_t child = fork();
  if (child == 0) {
    static_cast<void>(lock_calls_during([] {}));  // thread-local memory is taken at its first use
    static_cast<void>(allow_no_calls());
    const std::size_t heap_before = heap_calls();
    const std::size_t locks_before = lock_calls();
    const bool is_right = work();
    if (heap_calls() != heap_before) _exit(heap);
    if (lock_calls() != locks_before) _exit(locks);
    _exit(is_right ? nothing : wrong);
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) return "lost";
  if (WIFSIGNALED(status))
    return WTERMSIG(status) == SIGSYS ? "a system call" : strsignal(WTERMSIG(status));
  switch (WEXITSTATUS(status)) {
    case nothing: return "";
    case heap: return "the heap";
    case locks: return "a lock";
    case wrong: return "wrong results";
    default: return "an unknown end";
  }
}

}  // namespace torsio::test
