#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace torsio::detail {

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  [[nodiscard]] int number() const noexcept { return number_; }
  [[nodiscard]] bool is_open() const noexcept { return number_ >= 0; }

 private:
  int number_;
};

/// @throws Error "<place>: <problem>; found <text of the number>" with the advice
[[noreturn]] void refuse_system(const std::string& place, std::string_view problem,
                                int error_number, std::string_view advice = {});

/// CLOCK_MONOTONIC.
[[nodiscard]] std::int64_t monotonic_ns() noexcept;

/// A path of which one process at a time is the owner, by a lock on PATH.lock that the kernel ends with the process. What an
/// earlier owner has left at the path may therefore be removed.
class OwnedPath {
 public:
  OwnedPath() = default;
  /// @throws Error if another process owns it, or the lock cannot be made
  explicit OwnedPath(std::string path);
  OwnedPath(OwnedPath&&) = default;
  OwnedPath& operator=(OwnedPath&&) = default;
  /// Removes the path, but not the lock: a process that waits for it would hold one that no other process can find.
  ~OwnedPath();

  [[nodiscard]] const std::string& text() const noexcept { return path_; }

 private:
  std::string path_ = {};
  Descriptor lock_ = Descriptor();
};

/// Sets a terminal to raw bytes, 8N1, at this rate. @throws Error naming `place`
void set_raw(int descriptor, std::uint32_t baud, const std::string& place);

}  // namespace torsio::detail
