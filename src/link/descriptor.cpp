#include "link/descriptor.hpp"

#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <ctime>
#include <limits>
#include <system_error>

#include "torsio/core/error.hpp"
#include "torsio/link/link_transport.hpp"

namespace torsio {

void detail::refuse_system(const std::string& place, std::string_view problem, int error_number,
                           std::string_view advice) {
  throw Error({.place = place,
               .problem = std::string(problem),
               .found = std::generic_category().message(error_number),
               .advice = std::string(advice)});
}

std::int64_t detail::monotonic_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

detail::OwnedPath::OwnedPath(std::string path) : path_(std::move(path)) {
  const std::string lock = path_ + ".lock";
  lock_ = Descriptor(::open(lock.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!lock_.is_open())
    refuse_system(path_, "its lock cannot be made", errno,
                  "Choose a path in a folder that you may write.");
  if (::flock(lock_.number(), LOCK_EX | LOCK_NB) != 0)
    refuse_system(path_, "another process uses it", errno,
                  "End that process, or choose another path.");
  struct stat found {};
  if (::lstat(path_.c_str(), &found) != 0) return;
  if (!S_ISSOCK(found.st_mode) && !S_ISLNK(found.st_mode))
    refuse_system(path_, "it is neither a socket nor a link", EEXIST, "Choose another path.");
  ::unlink(path_.c_str());
}

detail::OwnedPath::~OwnedPath() {
  if (lock_.is_open() && !path_.empty()) ::unlink(path_.c_str());
}

bool LinkTransport::wait(std::int64_t longest_ns) const noexcept {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  pollfd each{.fd = descriptor(), .events = POLLIN, .revents = 0};
  const std::int64_t left_ns = longest_ns > 0 ? longest_ns : 0;
  const timespec time{.tv_sec = left_ns / kSecond_ns, .tv_nsec = left_ns % kSecond_ns};
  return ::ppoll(&each, 1, &time, nullptr) > 0;
}

double LinkTransport::line_B_s() const noexcept { return std::numeric_limits<double>::infinity(); }

}  // namespace torsio
