#include "realtime/loop_privileges.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/mman.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "torsio/core/error.hpp"

namespace torsio {

LoopPrivileges::LoopPrivileges(const LoopOptions& options) {
  pthread_getschedparam(pthread_self(), &policy_, &parameters_);
  pthread_getaffinity_np(pthread_self(), sizeof(cpus_), &cpus_);
  ask_for(options);
  if (!options.must_be_granted || grants_.refused.empty()) return;
  give_back();
  throw Error({.place = "real-time loop",
               .problem = "the operating system refuses " + grants_.refused,
               .advice = "Run it as root, or raise rtprio and memlock in "
                         "/etc/security/limits.conf; see docs/robot/realtime.md."});
}

LoopPrivileges::~LoopPrivileges() { give_back(); }

void LoopPrivileges::ask_for(const LoopOptions& options) {
  if (options.lock_memory) {
    grants_.memory_locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    if (!grants_.memory_locked) note_refusal("locked memory", errno);
  }
  if (options.cpu >= 0) {
    cpu_set_t one{};
    CPU_SET(static_cast<std::size_t>(options.cpu), &one);
    const int code = pthread_setaffinity_np(pthread_self(), sizeof(one), &one);
    grants_.cpu = code == 0;
    if (code != 0) note_refusal(fmt::format("CPU {}", options.cpu).c_str(), code);
  }
  if (options.priority > 0) {
    const sched_param wanted{.sched_priority = options.priority};
    const int code = pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted);
    grants_.fifo = code == 0;
    if (code != 0)
      note_refusal(fmt::format("SCHED_FIFO at priority {}", options.priority).c_str(), code);
  }
}

void LoopPrivileges::give_back() noexcept {
  if (grants_.fifo) pthread_setschedparam(pthread_self(), policy_, &parameters_);
  if (grants_.cpu) pthread_setaffinity_np(pthread_self(), sizeof(cpus_), &cpus_);
}

void LoopPrivileges::note_refusal(const char* what, int code) {
  grants_.refused += fmt::format("{}{} ({})", grants_.refused.empty() ? "" : ", ", what,
                                 std::generic_category().message(code));
}

[[gnu::noinline]] void touch_stack() noexcept {
  constexpr std::size_t kBytes = std::size_t{256} << 10;
  constexpr std::size_t kPage = 4096;
  std::array<volatile char, kBytes> stack;  // NOLINT: its content is not used
  for (std::size_t at = 0; at < kBytes; at += kPage) stack[at] = 0;
}

}  // namespace torsio
