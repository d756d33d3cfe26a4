#pragma once

#include <cstdint>
#include <string>

#include "torsio/core/progress.hpp"

namespace torsio {

/// What a reader of a file of unknown origin may use. A small file can describe much memory and work; the limits
/// are multiples of its size, so that a long recording has the room that it needs. Each reader states what
/// it is about to use before it does.
class ReadBudget {
 public:
  /// @param name of the file, in errors
  explicit ReadBudget(std::string name, Progress progress = {})
      : name_(std::move(name)), progress_(std::move(progress)) {}

  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] const Progress& progress() const noexcept { return progress_; }

  /// So many bytes of the file, in all, were read.
  void read_to(std::uint64_t bytes) noexcept { read_ = bytes; }
  /// So many bytes will be kept until the file has been read. @throws Error beyond the limit.
  void keep(std::uint64_t bytes) {
    require(bytes);
    kept_ += bytes;
  }
  /// So many bytes are needed for a while. @throws Error beyond the limit.
  void require(std::uint64_t bytes) const {
    if (bytes > memory_limit() || kept_ > memory_limit() - bytes) refuse_memory();
  }
  /// So many elements will be visited. @throws Error beyond the limit, Cancelled.
  void work(std::uint64_t elements) {
    worked_ += elements;
    if (worked_ >= next_report_) report();
  }

  /// Bytes that may be kept; grows with the bytes that were read.
  [[nodiscard]] std::uint64_t memory_limit() const noexcept {
    return kMemory + kMemoryPerByte * read_;
  }

  static constexpr std::uint64_t kMemory = std::uint64_t{256} << 20;
  static constexpr std::uint64_t kMemoryPerByte = 64;
  static constexpr std::uint64_t kWork = 20'000'000;
  static constexpr std::uint64_t kWorkPerByte = 200;

 private:
  void report();
  [[noreturn]] void refuse_memory() const;

  std::string name_;
  Progress progress_;
  std::uint64_t read_ = 0;
  std::uint64_t kept_ = 0;
  std::uint64_t worked_ = 0;
  std::uint64_t next_report_ = 0;
};

}  // namespace torsio
