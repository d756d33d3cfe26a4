#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "data/ros/streamed_messages.hpp"

namespace torsio {

/// The first bytes of an MCAP file.
inline constexpr std::string_view kMcapMark{"\x89MCAP0\r\n", 8};

/// Kinds of records.
enum class McapKind : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F
};

/// CRC-32 of bytes, as in the checksums of a file; `before`: that of the bytes before them.
[[nodiscard]] std::uint32_t mcap_checksum(std::string_view bytes,
                                          std::uint32_t before = 0) noexcept;

/// What a reader of a file of unknown origin takes at most.
struct McapLimits {
  std::size_t record_bytes = std::size_t{256}
                             << 20;  ///< largest record, and largest unpacked chunk
  std::size_t channels = 4096;
};

/// The messages of an MCAP file in the order of the file, read as a stream: the index at its end is
/// not used, so that the file of a recorder that was killed can be read up to its last whole record.
/// Chunks are plain, lz4 or zstd; their checksums are verified. Source: MCAP format specification.
class McapRecords final : public StreamedMessages {
 public:
  McapRecords(ByteSource& source, const std::string& name, McapLimits limits = {},
              Progress progress = {});

  bool next(LogMessage& message) override;

  /// The file ended inside a record, or without the record that ends its data.
  [[nodiscard]] bool is_unfinished() const noexcept override { return is_unfinished_; }

 private:
  void read_to_end();
  bool next_in_chunk(LogMessage& message);
  bool take(McapKind kind, std::string_view content, LogMessage& message);
  void open_chunk(std::string_view content);
  [[noreturn]] void refuse(const std::string& problem) const;

  McapLimits limits_;
  std::string record_;
  std::string chunk_;
  std::size_t chunk_at_ = 0;
  std::map<std::uint16_t, MessageSchema> schemas_;
  std::map<std::uint16_t, MessageChannel> channels_;
  bool is_at_end_ = false;
  bool is_unfinished_ = false;
};

}  // namespace torsio
