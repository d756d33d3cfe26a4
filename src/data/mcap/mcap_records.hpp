#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "data/byte_source.hpp"

namespace torsio {

/// The first bytes of an MCAP file.
inline constexpr std::string_view kMcapMark{"\x89MCAP0\r\n", 8};

struct McapSchema {
  std::string name;      ///< "sensor_msgs/msg/JointState"
  std::string encoding;  ///< form of the definition: "ros2msg", "jsonschema", ..
  std::string definition;
};

struct McapChannel {
  std::uint16_t id = 0;
  std::string topic;
  std::string encoding;  ///< form of the messages: "cdr", "json", ..
  McapSchema schema;     ///< empty if it has none
};

struct McapMessage {
  const McapChannel* channel = nullptr;
  std::int64_t log_time_ns = 0;
  std::string_view data;  ///< valid until the next message
};

/// What a reader of a file of unknown origin takes at most.
struct McapLimits {
  std::size_t record_bytes = std::size_t{256}
                             << 20;  ///< largest record, and largest unpacked chunk
  std::size_t channels = 4096;
};

/// The messages of an MCAP file in the order of the file, read as a stream: the index at its end is
/// not used, so that the file of a recorder that was killed can be read up to its last whole record.
/// Chunks are plain, lz4 or zstd; their checksums are verified. Source: MCAP format specification.
class McapRecords {
 public:
  McapRecords(ByteSource& source, std::string name, McapLimits limits = {});

  /// @returns false at the end. @throws Error with the byte where the file contradicts the format.
  bool next(McapMessage& message);

  /// The file ended inside a record, or without the record that ends its data.
  [[nodiscard]] bool is_unfinished() const noexcept { return is_unfinished_; }
  [[nodiscard]] const std::map<std::uint16_t, McapChannel>& channels() const noexcept {
    return channels_;
  }

 private:
  /// Reads `size` bytes into `to`. @returns false if the file ends before.
  bool read(std::string& to, std::size_t size);
  bool next_in_chunk(McapMessage& message);
  bool take(std::uint8_t kind, std::string_view content, McapMessage& message);
  void open_chunk(std::string_view content);
  [[noreturn]] void refuse(const std::string& problem) const;

  ByteSource& source_;
  std::string name_;
  McapLimits limits_;
  std::uint64_t place_ = 0;
  std::string record_;
  std::string chunk_;
  std::size_t chunk_at_ = 0;
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  bool is_at_end_ = false;
  bool is_unfinished_ = false;
};

}  // namespace torsio
