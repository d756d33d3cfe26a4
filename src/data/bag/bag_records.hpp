#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "data/ros/streamed_messages.hpp"

namespace torsio {

/// The first bytes of a bag of ROS 1.
inline constexpr std::string_view kBagMark = "#ROSBAG V2.0\n";

/// What a reader of a file of unknown origin takes at most.
struct BagLimits {
  std::size_t record_bytes = std::size_t{256}
                             << 20;  ///< largest record, and largest unpacked chunk
  std::size_t connections = 4096;
};

/// The messages of a bag of ROS 1 (version 2.0) in the order of the file, read as a stream; the index
/// at its end is not used. Chunks are plain, lz4 or bz2. Source: ROS wiki, Bags/Format/2.0.
class BagRecords final : public StreamedMessages {
 public:
  BagRecords(ByteSource& source, const std::string& name, BagLimits limits = {},
             Progress progress = {});

  bool next(LogMessage& message) override;
  [[nodiscard]] bool is_unfinished() const noexcept override { return is_unfinished_; }

 private:
  /// The header of a record: fields by name, and its data.
  struct Record {
    std::map<std::string_view, std::string_view> fields;
    std::string_view data;
  };

  /// Reads a record of the file into `record_`. @returns false at the end
  bool read_record(Record& record);
  bool next_in_chunk(LogMessage& message);
  bool take(const Record& record, LogMessage& message);
  void add_connection(const Record& record);
  void open_chunk(const Record& record);
  [[nodiscard]] std::map<std::string_view, std::string_view> fields_of(
      std::string_view header) const;
  template <class Number>
  [[nodiscard]] Number number(const Record& record, std::string_view field) const;
  [[noreturn]] void refuse(const std::string& problem) const;

  BagLimits limits_;
  std::string header_;
  std::string data_;
  std::string chunk_;
  std::size_t chunk_at_ = 0;
  std::map<std::uint32_t, MessageChannel> connections_;
  bool is_unfinished_ = false;
};

}  // namespace torsio
