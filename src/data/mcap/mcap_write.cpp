#include "data/mcap/mcap_write.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/report_progress.hpp"
#include "data/little_endian.hpp"
#include "data/mcap/mcap_records.hpp"
#include "data/ros/message_topics.hpp"
#include "data/written_columns.hpp"
#include "torsio/core/version.hpp"

namespace torsio {
namespace {

constexpr std::uint16_t kId = 1;  ///< id of the schema and of the channel
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr std::int64_t kNanoseconds = 1'000'000'000;

/// A name of a field of ROS 2: small letters, digits, and single underscores between them.
std::string field_name(std::string_view column) {
  std::string name;
  for (const char written : column) {
    const auto c = static_cast<unsigned char>(written);
    if (std::isalnum(c) != 0 && c < 0x80)
      name += static_cast<char>(std::tolower(c));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name.empty() || std::isalpha(static_cast<unsigned char>(name.front())) == 0 ? "x" + name
                                                                                     : name;
}

/// The definition of the messages, with the name of each column after that of its field. Numbers of
/// 8 bytes come first, so that none needs padding.
std::string definition(const Recording& recording) {
  constexpr std::string_view kLine =
      "================================================================================\n";
  std::set<std::string> fields{"header"};
  std::string text = "std_msgs/Header header\n";
  const auto add = [&](const char* type, const std::string& column) {
    std::string field = field_name(column);
    for (int number = 2; !fields.insert(field).second; ++number)
      field = fmt::format("{}_{}", field_name(column), number);
    text += fmt::format("{} {}  # {}\n", type, field, column);
  };
  add("float64", "t_s");
  for (const Channel& channel : recording.channels()) add("float64", channel.name);
  for (const Channel& channel : recording.channels())
    if (!channel.fresh.empty()) add("uint8", freshness_column(channel.name));
  text += fmt::format(
      "{0}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
      "{0}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
      kLine);
  return text;
}

struct ChunkPlace {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
  std::uint64_t start = 0;  ///< place of the chunk's record in the file
  std::uint64_t size = 0;
  std::uint64_t index_size = 0;
  std::uint64_t packed_size = 0;
  std::uint64_t unpacked_size = 0;
};

class McapFile {
 public:
  McapFile(const Recording& recording, OutputFile& file) : recording_(recording), file_(file) {
    LittleEndianWriter(schema_)
        .number(kId)
        .text<std::uint32_t>(kOwnSchema)
        .text<std::uint32_t>("ros2msg")
        .text<std::uint32_t>(definition(recording));
    LittleEndianWriter(channel_)
        .number(kId)
        .number(kId)
        .text<std::uint32_t>(kOwnTopic)
        .text<std::uint32_t>("cdr")
        .number(std::uint32_t{0});
    std::string header;
    LittleEndianWriter(header).text<std::uint32_t>("ros2").text<std::uint32_t>(
        fmt::format("torsio {}", kVersion));
    put(kMcapMark);
    put_record(McapKind::header, header);
    put_record(McapKind::schema, schema_);
    put_record(McapKind::channel, channel_);
  }

  void add_sample(std::size_t sample) {
    const std::int64_t stamp_ns = stamp_of(sample);
    index_.emplace_back(stamp_ns, chunk_.size());
    message_.clear();
    LittleEndianWriter message(message_);
    message.number(kId)
        .number(static_cast<std::uint32_t>(sample))
        .number(stamp_ns)
        .number(stamp_ns);
    constexpr std::string_view kLittleEndianCdr{"\x00\x01\x00\x00", 4};
    constexpr std::string_view kNoFrame{"\0\0\0\0", 4};  // a text of one NUL, and padding
    message.bytes(kLittleEndianCdr)
        .number(static_cast<std::int32_t>(stamp_ns / kNanoseconds))
        .number(static_cast<std::uint32_t>(stamp_ns % kNanoseconds))
        .number(std::uint32_t{1})
        .bytes(kNoFrame)
        .number(recording_.time_s(sample));
    for (const Channel& channel : recording_.channels()) message.number(channel.values[sample]);
    for (const Channel& channel : recording_.channels())
      if (!channel.fresh.empty()) message.number(channel.fresh[sample]);
    add_record(chunk_, McapKind::message, message_);
    if (chunk_.size() >= kChunkBytes) end_chunk();
  }

  /// Ends the last chunk and writes the summary.
  void finish() {
    end_chunk();
    put_record(McapKind::data_end, std::string(sizeof(std::uint32_t), '\0'));  // without checksum
    std::string summary;
    std::string offsets;
    const std::uint64_t summary_start = written_;
    const auto group = [&](McapKind kind, const auto& records) {
      const std::size_t begin = summary.size();
      for (const std::string& record : records) add_record(summary, kind, record);
      std::string offset;
      LittleEndianWriter(offset)
          .number(static_cast<std::uint8_t>(kind))
          .number(summary_start + begin)
          .number(static_cast<std::uint64_t>(summary.size() - begin));
      if (summary.size() > begin) add_record(offsets, McapKind::summary_offset, offset);
    };
    group(McapKind::schema, std::vector{schema_});
    group(McapKind::channel, std::vector{channel_});
    group(McapKind::statistics, std::vector{statistics()});
    group(McapKind::chunk_index, chunk_indices());
    const std::uint64_t offsets_start = summary_start + summary.size();
    summary += offsets;
    // The checksum goes from the summary to the footer's own two offsets.
    std::string footer;
    LittleEndianWriter writer(footer);
    writer.number(summary_start).number(offsets_start);
    std::string head;
    LittleEndianWriter(head)
        .number(static_cast<std::uint8_t>(McapKind::footer))
        .number(static_cast<std::uint64_t>(footer.size() + sizeof(std::uint32_t)));
    writer.number(mcap_checksum(footer, mcap_checksum(head, mcap_checksum(summary))));
    put(summary);
    put_record(McapKind::footer, footer);
    put(kMcapMark);
  }

 private:
  static void add_record(std::string& to, McapKind kind, std::string_view content) {
    LittleEndianWriter(to)
        .number(static_cast<std::uint8_t>(kind))
        .number(static_cast<std::uint64_t>(content.size()))
        .bytes(content);
  }
  void put(std::string_view bytes) {
    file_.write(std::as_bytes(std::span(bytes)));
    written_ += bytes.size();
  }
  void put_record(McapKind kind, std::string_view content) {
    std::string record;
    add_record(record, kind, content);
    put(record);
  }

  [[nodiscard]] std::int64_t stamp_of(std::size_t sample) const {
    const double start_s = std::min(recording_.time_s(0), 0.0);
    return static_cast<std::int64_t>(
        std::llround((recording_.time_s(sample) - start_s) * static_cast<double>(kNanoseconds)));
  }

  void end_chunk() {
    if (index_.empty()) return;
    packed_.resize(ZSTD_compressBound(chunk_.size()));
    packed_.resize(ZSTD_compress(packed_.data(), packed_.size(), chunk_.data(), chunk_.size(),
                                 ZSTD_CLEVEL_DEFAULT));
    ChunkPlace place{.first_ns = index_.front().first,
                     .last_ns = index_.back().first,
                     .start = written_,
                     .packed_size = packed_.size(),
                     .unpacked_size = chunk_.size()};
    std::string content;
    LittleEndianWriter(content)
        .number(place.first_ns)
        .number(place.last_ns)
        .number(place.unpacked_size)
        .number(mcap_checksum(chunk_))
        .text<std::uint32_t>("zstd")
        .text<std::uint64_t>(packed_);
    put_record(McapKind::chunk, content);
    place.size = written_ - place.start;
    std::string entries;
    for (const auto& [stamp_ns, offset] : index_)
      LittleEndianWriter(entries).number(stamp_ns).number(static_cast<std::uint64_t>(offset));
    std::string index;
    LittleEndianWriter(index).number(kId).text<std::uint32_t>(entries);
    put_record(McapKind::message_index, index);
    place.index_size = written_ - place.start - place.size;
    chunks_.push_back(place);
    messages_ += index_.size();
    chunk_.clear();
    index_.clear();
  }

  [[nodiscard]] std::string statistics() const {
    std::string counts;
    LittleEndianWriter(counts).number(kId).number(messages_);
    std::string record;
    LittleEndianWriter(record)
        .number(messages_)
        .number(std::uint16_t{1})  // schemas
        .number(std::uint32_t{1})  // channels
        .number(std::uint32_t{0})  // attachments
        .number(std::uint32_t{0})  // metadata
        .number(static_cast<std::uint32_t>(chunks_.size()))
        .number(chunks_.empty() ? std::int64_t{0} : chunks_.front().first_ns)
        .number(chunks_.empty() ? std::int64_t{0} : chunks_.back().last_ns)
        .text<std::uint32_t>(counts);
    return record;
  }

  [[nodiscard]] std::vector<std::string> chunk_indices() const {
    std::vector<std::string> records;
    for (const ChunkPlace& chunk : chunks_) {
      std::string places;
      LittleEndianWriter(places).number(kId).number(chunk.start + chunk.size);
      std::string record;
      LittleEndianWriter(record)
          .number(chunk.first_ns)
          .number(chunk.last_ns)
          .number(chunk.start)
          .number(chunk.size)
          .text<std::uint32_t>(places)
          .number(chunk.index_size)
          .text<std::uint32_t>("zstd")
          .number(chunk.packed_size)
          .number(chunk.unpacked_size);
      records.push_back(std::move(record));
    }
    return records;
  }

  const Recording& recording_;
  OutputFile& file_;
  std::uint64_t written_ = 0;
  std::uint64_t messages_ = 0;
  std::string schema_;
  std::string channel_;
  std::string message_;
  std::string chunk_;  ///< unpacked
  std::string packed_;
  std::vector<std::pair<std::int64_t, std::size_t>>
      index_;  ///< stamp and offset of each message of the chunk
  std::vector<ChunkPlace> chunks_;
};

}  // namespace

void write_mcap(const Recording& recording, OutputFile& file, const Progress& progress) {
  constexpr std::size_t kSamplesPerReport = 8192;
  check_columns(recording);
  McapFile mcap(recording, file);
  for (std::size_t i = 0; i < recording.size(); ++i) {
    if (i % kSamplesPerReport == 0)
      report_progress(progress, static_cast<double>(i) / static_cast<double>(recording.size()),
                      "writing");
    mcap.add_sample(i);
  }
  mcap.finish();
}

}  // namespace torsio
