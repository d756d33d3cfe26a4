#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "torsio/core/progress.hpp"

namespace torsio {

/// What a child process may use before the system ends it.
struct ChildLimits {
  /// Address space in addition to that of the parent; not limited under a sanitizer.
  std::size_t memory_bytes = std::size_t{6} << 30;
  unsigned cpu_s = 600;
};

/// Bytes of a child process, in memory that it shared.
class ChildOutput {
 public:
  ChildOutput(const void* bytes, std::size_t size) noexcept : bytes_(bytes), size_(size) {}
  ~ChildOutput();
  ChildOutput(const ChildOutput&) = delete;
  ChildOutput& operator=(const ChildOutput&) = delete;
  ChildOutput(ChildOutput&& other) noexcept
      : bytes_(other.bytes_), size_(std::exchange(other.size_, 0)) {}
  ChildOutput& operator=(ChildOutput&&) = delete;

  [[nodiscard]] std::string_view bytes() const noexcept {
    return {static_cast<const char*>(bytes_), size_};
  }

 private:
  const void* bytes_;
  std::size_t size_;
};

/// The bytes that `work` wrote into the descriptor, run in a child process, so that a crash of a
/// foreign library, or a file that makes it use all memory, is an error and not the end of the
/// program. The progress is called every 50 ms and may stop it.
/// @param work returns what went wrong, empty if nothing; it must not throw
/// @param place for messages
/// @throws Error if the work failed, crashed or reached a limit; Cancelled.
[[nodiscard]] ChildOutput output_of_child(const std::function<std::string(int descriptor)>& work,
                                          const std::string& place, const Progress& progress = {},
                                          const ChildLimits& limits = {});

/// Writes all bytes. @returns false if that fails
[[nodiscard]] bool write_all(int descriptor, const void* bytes, std::size_t size) noexcept;

}  // namespace torsio
