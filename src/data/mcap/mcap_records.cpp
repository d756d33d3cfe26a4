#include "data/mcap/mcap_records.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <utility>

#include "data/little_endian.hpp"
#include "data/names.hpp"
#include "data/ros/unpack_chunk.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kRecordHead = 9;  ///< its kind and its length

}  // namespace

std::uint32_t mcap_checksum(std::string_view bytes, std::uint32_t before) noexcept {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

McapRecords::McapRecords(ByteSource& source, const std::string& name, McapLimits limits,
                         Progress progress)
    : StreamedMessages(source, name, std::move(progress)), limits_(limits) {
  std::string mark;
  if (!read(mark, kMcapMark.size()) || mark != kMcapMark)
    refuse("the first bytes are not its mark");
}

void McapRecords::refuse(const std::string& problem) const {
  throw Error({.place = place(),
               .problem = problem,
               .expected = "an MCAP file",
               .advice = "`mcap recover` (or `mcap doctor`) may save the rest."});
}

bool McapRecords::next(LogMessage& message) {
  while (true) {
    if (next_in_chunk(message)) return true;
    if (is_at_end_) return false;
    std::string head;
    if (!read(head, kRecordHead)) {
      is_unfinished_ = is_at_end_ = true;
      return false;
    }
    LittleEndianReader reader(head);
    const auto kind = static_cast<McapKind>(*reader.number<std::uint8_t>());
    const std::uint64_t size = *reader.number<std::uint64_t>();
    if (static_cast<std::uint8_t>(kind) == 0) refuse("a record without a kind");
    if (size > limits_.record_bytes)
      refuse(fmt::format("a record of {} bytes; at most {} are read", size, limits_.record_bytes));
    budget().work(1);
    if (!read(record_, size)) {
      is_unfinished_ = is_at_end_ = true;
      return false;
    }
    if (kind == McapKind::data_end || kind == McapKind::footer) {
      is_at_end_ = true;
      if (kind == McapKind::data_end) read_to_end();
      return false;
    }
    if (kind == McapKind::chunk) {
      open_chunk(record_);
    } else if (take(kind, record_, message)) {
      return true;
    }
  }
}

// What follows the data is an index, the footer and the mark. The rest of a damaged file is not read.
void McapRecords::read_to_end() {
  std::string head;
  while (read(head, kRecordHead)) {
    LittleEndianReader reader(head);
    const auto kind = static_cast<McapKind>(*reader.number<std::uint8_t>());
    const std::uint64_t size = *reader.number<std::uint64_t>();
    budget().work(1);
    if (static_cast<std::uint8_t>(kind) == 0 || size > limits_.record_bytes || !read(record_, size))
      return;
    if (kind == McapKind::footer) return;
  }
}

bool McapRecords::next_in_chunk(LogMessage& message) {
  while (chunk_at_ < chunk_.size()) {
    LittleEndianReader reader(std::string_view(chunk_).substr(chunk_at_));
    const auto kind = reader.number<std::uint8_t>();
    const auto size = reader.number<std::uint64_t>();
    if (!kind || !size || *size > reader.left()) refuse("a chunk ends inside a record");
    const auto content = *reader.bytes(static_cast<std::size_t>(*size));
    chunk_at_ += reader.at();
    budget().work(1);
    if (take(static_cast<McapKind>(*kind), content, message)) return true;
  }
  return false;
}

bool McapRecords::take(McapKind kind, std::string_view content, LogMessage& message) {
  LittleEndianReader reader(content);
  if (kind == McapKind::message) {
    const auto id = reader.number<std::uint16_t>();
    const auto sequence = reader.number<std::uint32_t>();
    const auto log_time = reader.number<std::int64_t>();
    const auto publish_time = reader.number<std::int64_t>();
    if (!id || !sequence || !log_time || !publish_time) refuse("a message is too short");
    const auto channel = channels_.find(*id);
    if (channel == channels_.end())
      refuse(fmt::format("a message of channel {}, not declared", *id));
    message = {.channel = &channel->second, .log_time_ns = *log_time, .data = reader.rest()};
    return true;
  }
  if (kind == McapKind::schema) {
    const auto id = reader.number<std::uint16_t>();
    const auto name = reader.text<std::uint32_t>();
    const auto encoding = reader.text<std::uint32_t>();
    const auto definition = reader.text<std::uint32_t>();
    if (!id || !name || !encoding || !definition) refuse("a schema is too short");
    budget().keep(definition->size());
    schemas_[*id] = {escaped(*name), escaped(*encoding), std::string(*definition)};
  }
  if (kind == McapKind::channel) {
    const auto id = reader.number<std::uint16_t>();
    const auto schema = reader.number<std::uint16_t>();
    const auto topic = reader.text<std::uint32_t>();
    const auto encoding = reader.text<std::uint32_t>();
    if (!id || !schema || !topic || !encoding) refuse("a channel is too short");
    const auto found = schemas_.find(*schema);
    if (*schema != 0 && found == schemas_.end())
      refuse(fmt::format("channel '{}' has a schema that is not declared", printable(*topic)));
    if (channels_.size() >= limits_.channels)
      refuse(fmt::format("more than {} channels", limits_.channels));
    if (*schema != 0) budget().keep(found->second.definition.size());
    channels_.try_emplace(*id,
                          MessageChannel{.topic = escaped(*topic),
                                         .encoding = escaped(*encoding),
                                         .schema = *schema == 0 ? MessageSchema{} : found->second});
  }
  return false;
}

void McapRecords::open_chunk(std::string_view content) {
  LittleEndianReader reader(content);
  const auto first = reader.number<std::uint64_t>();
  const auto last = reader.number<std::uint64_t>();
  const auto size = reader.number<std::uint64_t>();
  const auto expected = reader.number<std::uint32_t>();
  const auto packing = reader.text<std::uint32_t>();
  const auto packed = reader.text<std::uint64_t>();
  if (!first || !last || !size || !expected || !packing || !packed) refuse("a chunk is too short");
  if (*size > limits_.record_bytes)
    refuse(fmt::format("a chunk of {} bytes; at most {} are read", *size, limits_.record_bytes));
  budget().require(*size);
  chunk_at_ = 0;
  if (!unpack_chunk(*packing, *packed, static_cast<std::size_t>(*size), chunk_))
    refuse(fmt::format("a chunk packed by '{}' cannot be unpacked; known are {}",
                       printable(*packing), kKnownPackings));
  if (*expected != 0 && mcap_checksum(chunk_) != *expected)
    refuse("the checksum of a chunk is wrong");
}

}  // namespace torsio
