#include "data/mcap/mcap_records.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <utility>

#include "data/mcap/little_endian.hpp"
#include "data/mcap/unpack_chunk.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

// Kinds of records.
constexpr std::uint8_t kFooter = 0x02;
constexpr std::uint8_t kSchema = 0x03;
constexpr std::uint8_t kChannel = 0x04;
constexpr std::uint8_t kMessage = 0x05;
constexpr std::uint8_t kChunk = 0x06;
constexpr std::uint8_t kDataEnd = 0x0F;

constexpr std::size_t kRecordHead = 9;  ///< its kind and its length

std::uint32_t checksum(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

McapRecords::McapRecords(ByteSource& source, std::string name, McapLimits limits)
    : source_(source), name_(std::move(name)), limits_(limits) {
  std::string mark;
  if (!read(mark, kMcapMark.size()) || mark != kMcapMark)
    refuse("the first bytes are not its mark");
}

void McapRecords::refuse(const std::string& problem) const {
  throw Error({.place = fmt::format("{}: byte {}", name_, place_),
               .problem = problem,
               .expected = "an MCAP file",
               .advice = "`mcap recover` (or `mcap doctor`) may save the rest."});
}

bool McapRecords::read(std::string& to, std::size_t size) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  to.clear();
  while (to.size() < size) {
    // The length is the file's word: memory grows with what arrives.
    const std::size_t before = to.size();
    to.resize(std::min(size, before + kBlock));
    const std::size_t got = source_.read(to.data() + before, to.size() - before);
    to.resize(before + got);
    if (got == 0) return false;
  }
  place_ += size;
  return true;
}

bool McapRecords::next(McapMessage& message) {
  while (true) {
    if (next_in_chunk(message)) return true;
    if (is_at_end_) return false;
    std::string head;
    if (!read(head, kRecordHead)) {
      is_unfinished_ = is_at_end_ = true;
      return false;
    }
    LittleEndianReader reader(head);
    const std::uint8_t kind = *reader.number<std::uint8_t>();
    const std::uint64_t size = *reader.number<std::uint64_t>();
    if (size > limits_.record_bytes)
      refuse(fmt::format("a record of {} bytes; at most {} are read", size, limits_.record_bytes));
    if (!read(record_, size)) {
      is_unfinished_ = is_at_end_ = true;
      return false;
    }
    if (kind == kDataEnd || kind == kFooter) {
      is_at_end_ = true;
      while (read(record_, std::size_t{1} << 16)) {
      }  // the hash is that of the whole file
      return false;
    }
    if (kind == kChunk) {
      open_chunk(record_);
    } else if (take(kind, record_, message)) {
      return true;
    }
  }
}

bool McapRecords::next_in_chunk(McapMessage& message) {
  while (chunk_at_ < chunk_.size()) {
    LittleEndianReader reader(std::string_view(chunk_).substr(chunk_at_));
    const auto kind = reader.number<std::uint8_t>();
    const auto size = reader.number<std::uint64_t>();
    if (!kind || !size || *size > reader.left()) refuse("a chunk ends inside a record");
    const auto content = *reader.bytes(static_cast<std::size_t>(*size));
    chunk_at_ += reader.at();
    if (take(*kind, content, message)) return true;
  }
  return false;
}

bool McapRecords::take(std::uint8_t kind, std::string_view content, McapMessage& message) {
  LittleEndianReader reader(content);
  if (kind == kMessage) {
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
  if (kind == kSchema) {
    const auto id = reader.number<std::uint16_t>();
    const auto name = reader.text<std::uint32_t>();
    const auto encoding = reader.text<std::uint32_t>();
    const auto definition = reader.text<std::uint32_t>();
    if (!id || !name || !encoding || !definition) refuse("a schema is too short");
    schemas_[*id] = {escaped(*name), escaped(*encoding), std::string(*definition)};
  }
  if (kind == kChannel) {
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
    channels_.try_emplace(*id, McapChannel{.id = *id,
                                           .topic = escaped(*topic),
                                           .encoding = escaped(*encoding),
                                           .schema = *schema == 0 ? McapSchema{} : found->second});
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
  chunk_at_ = 0;
  if (!unpack_chunk(*packing, *packed, static_cast<std::size_t>(*size), chunk_))
    refuse(fmt::format("a chunk packed by '{}' cannot be unpacked; known are {}",
                       printable(*packing), kKnownPackings));
  if (*expected != 0 && checksum(chunk_) != *expected) refuse("the checksum of a chunk is wrong");
}

}  // namespace torsio
