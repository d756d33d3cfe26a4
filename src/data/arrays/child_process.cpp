#include "data/arrays/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/report_progress.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kLimitsMemory = false;  // the sanitizer reserves terabytes of addresses
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kLimitsMemory = false;
#else
constexpr bool kLimitsMemory = true;
#endif
#else
constexpr bool kLimitsMemory = true;
#endif

constexpr int kFailed = 3;  ///< exit status; the reason is the last that was written

class Descriptor {
 public:
  explicit Descriptor(int number) noexcept : number_(number) {}
  ~Descriptor() { close_now(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int number() const noexcept { return number_; }
  void close_now() noexcept {
    if (number_ >= 0) close(number_);
    number_ = -1;
  }

 private:
  int number_;
};

/// Ends the child unless `wait` was called.
class Child {
 public:
  explicit Child(pid_t id) noexcept : id_(id) {}
  ~Child() {
    if (id_ <= 0) return;
    kill(id_, SIGKILL);
    static_cast<void>(wait());
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  int wait() noexcept {
    int status = 0;
    while (waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = 0;
    return status;
  }

 private:
  pid_t id_;
};

[[noreturn]] void refuse_system(const std::string& place, const char* what) {
  throw Error({.place = place,
               .problem = fmt::format("{}: {}", what, std::generic_category().message(errno))});
}

/// What the parent has mapped, which a child inherits; 0 if it is not known.
std::size_t own_address_space() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

/// The child: never returns, and runs no destructors of the parent's objects.
[[noreturn]] void run_child(const std::function<std::string(int)>& work, int results, int reasons,
                            const ChildLimits& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL})
    std::signal(signal, SIG_DFL);
  const rlimit cpu{limits.cpu_s, limits.cpu_s};
  setrlimit(RLIMIT_CPU, &cpu);
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  if (kLimitsMemory) {
    const rlim_t bytes = limits.memory_bytes + own_address_space();
    const rlimit memory{bytes, bytes};
    setrlimit(RLIMIT_AS, &memory);
  }
  if (const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC); nowhere >= 0) {
    dup2(nowhere, STDOUT_FILENO);
    dup2(nowhere, STDERR_FILENO);
  }
  const std::string reason = work(results);
  if (reason.empty()) _exit(0);
  static_cast<void>(write_all(reasons, reason.data(), reason.size()));
  _exit(kFailed);
}

/// Everything that arrives in the pipe, until the child closes it.
std::string read_all(const Descriptor& pipe, const Progress& progress) {
  constexpr int kWaitMs = 50;
  std::string text;
  pollfd waits{.fd = pipe.number(), .events = POLLIN, .revents = 0};
  while (true) {
    report_progress(progress, 0.0, "reading");
    if (poll(&waits, 1, kWaitMs) <= 0) continue;
    std::array<char, 4096> block{};
    const ssize_t got = read(pipe.number(), block.data(), block.size());
    if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN)) return text;
    if (got > 0) text.append(block.data(), static_cast<std::size_t>(got));
  }
}

ChildOutput output_in(const Descriptor& memory, const std::string& place) {
  const off_t size = lseek(memory.number(), 0, SEEK_END);
  if (size < 0) refuse_system(place, "no shared memory");
  if (size == 0) return {nullptr, 0};
  const auto bytes = static_cast<std::size_t>(size);
  void* const mapped = mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, memory.number(), 0);
  if (mapped == MAP_FAILED) refuse_system(place, "no shared memory");
  return {mapped, bytes};
}

}  // namespace

bool write_all(int descriptor, const void* bytes, std::size_t size) noexcept {
  const char* at = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = write(descriptor, at, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    at += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

ChildOutput::~ChildOutput() {
  if (size_ > 0) munmap(const_cast<void*>(bytes_), size_);
}

ChildOutput output_of_child(const std::function<std::string(int)>& work, const std::string& place,
                            const Progress& progress, const ChildLimits& limits) {
  const Descriptor memory(memfd_create("torsio", MFD_CLOEXEC));
  if (memory.number() < 0) refuse_system(place, "no shared memory");
  std::array<int, 2> pipe{};
  if (pipe2(pipe.data(), O_CLOEXEC) != 0) refuse_system(place, "no pipe");
  const Descriptor reasons(pipe[0]);
  Descriptor reasons_in(pipe[1]);
  const pid_t id = fork();
  if (id < 0) refuse_system(place, "no process");
  if (id == 0) run_child(work, memory.number(), reasons_in.number(), limits);
  Child child(id);
  reasons_in.close_now();
  std::string reason = read_all(reasons, progress);
  const int status = child.wait();
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return output_in(memory, place);
  if (reason.empty())
    reason = WIFSIGNALED(status) ? fmt::format("the library that reads it ended by signal {} ({})",
                                               WTERMSIG(status), sigdescr_np(WTERMSIG(status)))
                                 : "the library that reads it ended without result";
  throw Error({.place = place, .problem = reason});
}

}  // namespace torsio
