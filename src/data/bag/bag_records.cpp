#include "data/bag/bag_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "data/little_endian.hpp"
#include "data/names.hpp"
#include "data/ros/unpack_chunk.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

// The kinds of records that are read: field "op" of their headers.
constexpr std::uint8_t kMessage = 0x02;
constexpr std::uint8_t kBagHeader = 0x03;
constexpr std::uint8_t kChunkRecord = 0x05;
constexpr std::uint8_t kConnection = 0x07;

constexpr std::int64_t kNanoseconds = 1'000'000'000;

std::string_view field_of(const std::map<std::string_view, std::string_view>& fields,
                          std::string_view name) {
  const auto at = fields.find(name);
  return at == fields.end() ? std::string_view{} : at->second;
}

}  // namespace

BagRecords::BagRecords(ByteSource& source, const std::string& name, BagLimits limits,
                       Progress progress)
    : StreamedMessages(source, name, std::move(progress)), limits_(limits) {
  std::string mark;
  if (!read(mark, kBagMark.size()) || mark != kBagMark) refuse("the first bytes are not its mark");
}

void BagRecords::refuse(const std::string& problem) const {
  throw Error({.place = place(),
               .problem = problem,
               .expected = "a bag of ROS 1, version 2.0",
               .advice = "`rosbag reindex` or `rosbag fix` may save the rest."});
}

std::map<std::string_view, std::string_view> BagRecords::fields_of(std::string_view header) const {
  std::map<std::string_view, std::string_view> fields;
  LittleEndianReader reader(header);
  while (reader.left() > 0) {
    const auto field = reader.text<std::uint32_t>();
    const std::size_t equals = field ? field->find('=') : std::string_view::npos;
    if (equals == std::string_view::npos) refuse("the header of a record is not a list of fields");
    fields[field->substr(0, equals)] = field->substr(equals + 1);
  }
  return fields;
}

template <class Number>
Number BagRecords::number(const Record& record, std::string_view field) const {
  LittleEndianReader reader(field_of(record.fields, field));
  const auto value = reader.number<Number>();
  if (!value) refuse(fmt::format("a record without the number '{}'", field));
  return *value;
}

bool BagRecords::read_record(Record& record) {
  const auto part = [&](std::string& to) {
    std::string size_bytes;
    if (!read(size_bytes, sizeof(std::uint32_t))) {
      is_unfinished_ = is_unfinished_ || !size_bytes.empty();
      return false;
    }
    const auto size = *LittleEndianReader(size_bytes).number<std::uint32_t>();
    if (size > limits_.record_bytes)
      refuse(fmt::format("a record of {} bytes; at most {} are read", size, limits_.record_bytes));
    if (read(to, size)) return true;
    is_unfinished_ = true;
    return false;
  };
  if (!part(header_)) return false;
  if (!part(data_)) {
    is_unfinished_ = true;
    return false;
  }
  record = {.fields = fields_of(header_), .data = data_};
  return true;
}

bool BagRecords::next(LogMessage& message) {
  while (true) {
    if (next_in_chunk(message)) return true;
    Record record;
    if (!read_record(record)) return false;
    budget().work(1);
    const auto kind = number<std::uint8_t>(record, "op");
    if (kind == kBagHeader) {
      // Zero until the recorder closes the file.
      is_unfinished_ = number<std::uint64_t>(record, "index_pos") == 0;
    } else if (kind == kChunkRecord) {
      open_chunk(record);
    } else if (take(record, message)) {
      return true;
    }
  }
}

bool BagRecords::next_in_chunk(LogMessage& message) {
  while (chunk_at_ < chunk_.size()) {
    LittleEndianReader reader(std::string_view(chunk_).substr(chunk_at_));
    const auto header = reader.text<std::uint32_t>();
    const auto data = reader.text<std::uint32_t>();
    if (!header || !data) refuse("a chunk ends inside a record");
    chunk_at_ += reader.at();
    budget().work(1);
    if (take({.fields = fields_of(*header), .data = *data}, message)) return true;
  }
  return false;
}

bool BagRecords::take(const Record& record, LogMessage& message) {
  const auto kind = number<std::uint8_t>(record, "op");
  if (kind == kConnection) add_connection(record);
  if (kind != kMessage) return false;
  const auto connection = connections_.find(number<std::uint32_t>(record, "conn"));
  if (connection == connections_.end()) refuse("a message of a connection that is not declared");
  LittleEndianReader time(field_of(record.fields, "time"));
  const auto seconds = time.number<std::uint32_t>();
  const auto nanoseconds = time.number<std::uint32_t>();
  if (!seconds || !nanoseconds) refuse("a message without time");
  message = {.channel = &connection->second,
             .log_time_ns = kNanoseconds * *seconds + *nanoseconds,
             .data = record.data};
  return true;
}

void BagRecords::add_connection(const Record& record) {
  const auto fields = fields_of(record.data);
  if (connections_.size() >= limits_.connections)
    refuse(fmt::format("more than {} connections", limits_.connections));
  budget().keep(record.data.size());
  connections_.try_emplace(
      number<std::uint32_t>(record, "conn"),
      MessageChannel{
          .topic = escaped(field_of(record.fields, "topic")),
          .encoding = "ros1",
          .schema = {.name = escaped(field_of(fields, "type")),
                     .encoding = "ros1msg",
                     .definition = std::string(field_of(fields, "message_definition"))}});
}

void BagRecords::open_chunk(const Record& record) {
  const auto size = number<std::uint32_t>(record, "size");
  const std::string_view packing = field_of(record.fields, "compression");
  if (size > limits_.record_bytes)
    refuse(fmt::format("a chunk of {} bytes; at most {} are read", size, limits_.record_bytes));
  budget().require(size);
  chunk_at_ = 0;
  if (!unpack_chunk(packing, record.data, size, chunk_))
    refuse(fmt::format("a chunk packed by '{}' cannot be unpacked; known are {}",
                       printable(packing), kKnownPackings));
}

}  // namespace torsio
