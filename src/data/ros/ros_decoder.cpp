#include "data/ros/ros_decoder.hpp"

#include <algorithm>
#include <utility>

#include "data/names.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxElements = 100;
constexpr std::int64_t kNanoseconds = 1'000'000'000;

/// Bytes of an image or a point cloud are not signals.
bool is_raw(const RosField& field) {
  return field.count != RosField::Count::one && bytes_of(field.kind) == 1;
}

}  // namespace

RosDecoder::RosDecoder(std::string topic, RosSchema schema, RosEncoding encoding)
    : topic_(std::move(topic)),
      schema_(std::move(schema)),
      encoding_(encoding),
      root_{.name = topic_} {}

bool RosDecoder::decode(std::string_view message, TopicTable& table, ReadBudget& budget) {
  constexpr std::size_t kEncapsulation = 4;
  constexpr char kLittleEndianCdr = 1;
  stamp_ns_ = 0;
  table_ = &table;
  budget_ = &budget;
  const bool has_head = encoding_ == RosEncoding::cdr;
  const bool is_known = !has_head || (message.size() >= kEncapsulation && message[0] == 0 &&
                                      message[1] == kLittleEndianCdr);
  reader_ = LittleEndianReader(is_known && has_head ? message.substr(kEncapsulation) : message);
  if (is_known && decode_type(0, root_)) return true;
  table.drop_row();
  return false;
}

bool RosDecoder::decode_type(std::size_t type, Place& place) {
  const std::vector<RosField>& fields = schema_.types[type].fields;
  if (place.parts.empty())
    for (const RosField& field : fields) add_part(place, place.name + "/" + field.name);
  for (std::size_t i = 0; i < fields.size(); ++i)
    if (!decode_field(fields[i], place.parts[i])) return false;
  return true;
}

bool RosDecoder::decode_field(const RosField& field, Place& place) {
  if (field.count == RosField::Count::one) return decode_one(field, place);
  std::size_t count = field.size;
  if (field.count == RosField::Count::sequence) {
    if (!align(sizeof(std::uint32_t))) return false;
    const auto found = reader_.number<std::uint32_t>();
    if (!found) return false;
    count = *found;
  }
  if (count > reader_.left()) return false;  // an element has a byte at least
  if (field.kind == RosKind::text && place.name == topic_ + "/name") return decode_names(count);
  if (is_raw(field) || field.kind == RosKind::text) return skip(field, count);
  return decode_elements(field, count, place);
}

bool RosDecoder::decode_elements(const RosField& field, std::size_t count, Place& place) {
  const std::size_t known = std::min(count, kMaxElements);
  for (std::size_t i = 0; i < known; ++i)
    if (!decode_one(field, element(place, field, i))) return false;
  return skip(field, count - known);
}

/// An element by its index, or by the joint's name, which may change from message to message.
RosDecoder::Place& RosDecoder::element(Place& place, const RosField& field,
                                       std::size_t index) const {
  if (place.names_version != names_version_) {
    place.parts.clear();
    place.names_version = names_version_;
  }
  while (place.parts.size() <= index) {
    const std::size_t next = place.parts.size();
    add_part(place, next < names_.size() ? topic_ + "/" + names_[next] + "/" + field.name
                                         : place.name + "/" + std::to_string(next));
  }
  return place.parts[index];
}

void RosDecoder::add_part(Place& place, std::string name) const {
  budget_->keep(2 * sizeof(Place) + name.size());
  place.parts.push_back({.name = std::move(name)});
}

bool RosDecoder::decode_names(std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < count; ++i) {
    budget_->work(1);
    if (!align(sizeof(std::uint32_t))) return false;
    const auto text = reader_.text<std::uint32_t>();
    if (!text) return false;
    if (i < kMaxElements) names.push_back(escaped(text->substr(0, text->find('\0'))));
  }
  if (names != names_) {
    names_ = std::move(names);
    ++names_version_;
  }
  return true;
}

bool RosDecoder::decode_one(const RosField& field, Place& place) {
  budget_->work(1);
  if (field.kind == RosKind::text) return skip(field, 1);
  if (field.kind == RosKind::nested)
    return is_time(field) ? decode_time(place) : decode_type(field.type, place);
  const auto value = number(field.kind);
  if (!value) return false;
  if (!place.column) place.column = table_->column(place.name, *budget_);
  table_->set(*place.column, *value);
  return true;
}

bool RosDecoder::is_time(const RosField& field) const {
  const std::string& name = schema_.types[field.type].name;
  return name == "builtin_interfaces/Time" || name == "builtin_interfaces/Duration";
}

bool RosDecoder::decode_time(Place& place) {
  if (!align(sizeof(std::int32_t))) return false;
  const auto seconds = reader_.number<std::int32_t>();
  const auto nanoseconds = reader_.number<std::uint32_t>();
  if (!seconds || !nanoseconds) return false;
  const std::int64_t stamp_ns = kNanoseconds * *seconds + *nanoseconds;
  if (!place.column) place.column = table_->column(place.name, *budget_);
  table_->set(*place.column, 1e-9 * static_cast<double>(stamp_ns));
  if (place.name == topic_ + "/header/stamp") stamp_ns_ = stamp_ns;
  return true;
}

bool RosDecoder::skip(const RosField& field, std::size_t count) {
  if (count == 0) return true;
  if (const std::size_t bytes = bytes_of(field.kind); bytes > 0)
    return align(bytes) && count <= reader_.left() / bytes &&
           reader_.bytes(count * bytes).has_value();
  for (std::size_t i = 0; i < count; ++i) {
    budget_->work(1);
    if (field.kind == RosKind::text) {
      if (!align(sizeof(std::uint32_t)) || !reader_.text<std::uint32_t>()) return false;
      continue;
    }
    for (const RosField& part : schema_.types[field.type].fields) {
      std::size_t parts = part.size;
      if (part.count == RosField::Count::sequence) {
        if (!align(sizeof(std::uint32_t))) return false;
        const auto found = reader_.number<std::uint32_t>();
        if (!found) return false;
        parts = *found;
      }
      if (parts > reader_.left() || !skip(part, parts)) return false;
    }
  }
  return true;
}

template <class Number>
std::optional<double> RosDecoder::read_as_double() {
  if (!align(sizeof(Number))) return std::nullopt;
  const auto value = reader_.number<Number>();
  return value ? std::optional(static_cast<double>(*value)) : std::nullopt;
}

std::optional<double> RosDecoder::number(RosKind kind) {
  switch (kind) {
    case RosKind::boolean:
    case RosKind::uint8: return read_as_double<std::uint8_t>();
    case RosKind::int8: return read_as_double<std::int8_t>();
    case RosKind::int16: return read_as_double<std::int16_t>();
    case RosKind::uint16: return read_as_double<std::uint16_t>();
    case RosKind::int32: return read_as_double<std::int32_t>();
    case RosKind::uint32: return read_as_double<std::uint32_t>();
    case RosKind::int64: return read_as_double<std::int64_t>();
    case RosKind::uint64: return read_as_double<std::uint64_t>();
    case RosKind::float32: return read_as_double<float>();
    case RosKind::float64: return read_as_double<double>();
    case RosKind::text:
    case RosKind::nested: break;
  }
  return std::nullopt;
}

}  // namespace torsio
