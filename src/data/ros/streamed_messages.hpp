#pragma once

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "data/byte_source.hpp"
#include "data/ros/message_source.hpp"

namespace torsio {

/// The messages of a file that is read from its beginning to its end.
class StreamedMessages : public MessageSource {
 protected:
  /// `source` must outlive it.
  StreamedMessages(ByteSource& source, const std::string& name, Progress progress)
      : MessageSource(ReadBudget(name, std::move(progress))), source_(source) {}

  /// Reads `size` bytes into `to`. @returns false if the file ends before.
  bool read(std::string& to, std::size_t size) {
    const bool is_whole = read_exactly(source_, to, size);
    budget().read_to(source_.bytes_read());
    if (is_whole) bytes_ += size;
    return is_whole;
  }
  /// Where the file has been read to, for messages.
  [[nodiscard]] std::string place() const {
    return fmt::format("{}: byte {}", budget().name(), bytes_);
  }

 private:
  ByteSource& source_;
  std::uint64_t bytes_ = 0;
};

}  // namespace torsio
