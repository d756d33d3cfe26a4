#include "link/can_datagram.hpp"

#include <algorithm>
#include <string_view>

namespace torsio::detail {
namespace {

// First bytes of MessagePack (github.com/msgpack/msgpack/blob/master/spec.md).
constexpr std::uint8_t kNil = 0xC0;
constexpr std::uint8_t kFalse = 0xC2;
constexpr std::uint8_t kTrue = 0xC3;
constexpr std::uint8_t kBin8 = 0xC4;
constexpr std::uint8_t kBin32 = 0xC6;
constexpr std::uint8_t kFloat32 = 0xCA;
constexpr std::uint8_t kFloat64 = 0xCB;
constexpr std::uint8_t kUint8 = 0xCC;
constexpr std::uint8_t kUint32 = 0xCE;
constexpr std::uint8_t kUint64 = 0xCF;
constexpr std::uint8_t kInt8 = 0xD0;
constexpr std::uint8_t kInt64 = 0xD3;
constexpr std::uint8_t kStr8 = 0xD9;
constexpr std::uint8_t kStr32 = 0xDB;
constexpr std::uint8_t kMap16 = 0xDE;
constexpr std::uint8_t kMap32 = 0xDF;
constexpr std::uint8_t kFixStr = 0xA0;  // and its length below 32
constexpr std::uint8_t kFixMap = 0x80;  // and its length below 16
constexpr std::uint8_t kFirstNegative = 0xE0;

/// A value without parts.
struct Value {
  enum class Type : std::uint8_t { nil, boolean, whole, negative, real, text, bytes };
  Type type = Type::nil;
  bool boolean = false;
  std::uint64_t whole = 0;
  std::span<const std::uint8_t> bytes = {};  ///< a text or bytes
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) noexcept : left_(bytes) {}

  [[nodiscard]] bool is_at_end() const noexcept { return left_.empty(); }

  bool read_map_size(std::uint64_t& size) noexcept {
    std::uint64_t first = 0;
    if (!read_number(1, first)) return false;
    if (first >= kFixMap && first < kFixMap + 16U) {
      size = first - kFixMap;
      return true;
    }
    return (first == kMap16 && read_number(2, size)) || (first == kMap32 && read_number(4, size));
  }

  /// @returns false at the end of the bytes, and for arrays, maps and extensions
  bool read(Value& value) noexcept {
    value = {};
    std::uint64_t head = 0;
    if (!read_number(1, head)) return false;
    const auto first = static_cast<std::uint8_t>(head);
    if (first < kFixMap || first >= kFirstNegative) {
      value = {.type = first < kFixMap ? Value::Type::whole : Value::Type::negative,
               .whole = first};
      return true;
    }
    if (first >= kFixStr && first < kNil)
      return read_bytes(first - std::uint64_t{kFixStr}, Value::Type::text, value);
    switch (first) {
      case kNil: return true;
      case kFalse:
      case kTrue: value = {.type = Value::Type::boolean, .boolean = first == kTrue}; return true;
      case kFloat32: return read_bytes(4, Value::Type::real, value);
      case kFloat64: return read_bytes(8, Value::Type::real, value);
      default: return read_sized(first, value);
    }
  }

 private:
  /// Numbers, texts and bytes whose size or length follows.
  bool read_sized(std::uint8_t first, Value& value) noexcept {
    if (first >= kUint8 && first <= kUint64) {
      value.type = Value::Type::whole;
      return read_number(std::size_t{1} << (first - kUint8), value.whole);
    }
    if (first >= kInt8 && first <= kInt64) {
      const std::size_t size = std::size_t{1} << (first - kInt8);
      if (!read_number(size, value.whole)) return false;
      const bool is_negative = (value.whole >> (8U * size - 1U)) != 0;
      value.type = is_negative ? Value::Type::negative : Value::Type::whole;
      return true;
    }
    std::uint64_t length = 0;
    if (first >= kBin8 && first <= kBin32)
      return read_number(std::size_t{1} << (first - kBin8), length) &&
             read_bytes(length, Value::Type::bytes, value);
    if (first >= kStr8 && first <= kStr32)
      return read_number(std::size_t{1} << (first - kStr8), length) &&
             read_bytes(length, Value::Type::text, value);
    return false;
  }
  /// High byte first.
  bool read_number(std::size_t size, std::uint64_t& number) noexcept {
    if (left_.size() < size) return false;
    number = 0;
    for (const std::uint8_t byte : left_.first(size)) number = number << 8U | byte;
    left_ = left_.subspan(size);
    return true;
  }
  bool read_bytes(std::uint64_t size, Value::Type type, Value& value) noexcept {
    if (left_.size() < size) return false;
    value.type = type;
    value.bytes = left_.first(static_cast<std::size_t>(size));
    left_ = left_.subspan(static_cast<std::size_t>(size));
    return true;
  }

  std::span<const std::uint8_t> left_;
};

bool is_text(const Value& value, std::string_view text) noexcept {
  return value.type == Value::Type::text &&
         std::ranges::equal(value.bytes, text, {}, {},
                            [](char letter) { return static_cast<std::uint8_t>(letter); });
}

bool take_flag(const Value& value, bool& flag) noexcept {
  flag = value.boolean;
  return value.type == Value::Type::boolean;
}

/// The fields of a map that matter.
struct Fields {
  CanFrame frame = {.is_extended = true};
  bool has_id = false;
  bool has_size = false;
  std::uint64_t size = 0;
  std::span<const std::uint8_t> data = {};
  bool is_fd = false;

  /// @returns false for a value that this field cannot have
  bool take(const Value& key, const Value& value) noexcept {
    if (is_text(key, "arbitration_id")) {
      has_id = value.type == Value::Type::whole && value.whole <= kCanHighestExtendedId;
      frame.id = static_cast<std::uint32_t>(value.whole & kCanHighestExtendedId);
      return has_id;
    }
    if (is_text(key, "dlc")) {
      has_size = value.type != Value::Type::nil;
      size = value.whole;
      return !has_size || value.type == Value::Type::whole;
    }
    if (is_text(key, "data")) {
      data = value.bytes;
      return value.type == Value::Type::bytes || value.type == Value::Type::nil;
    }
    if (is_text(key, "is_extended_id")) return take_flag(value, frame.is_extended);
    if (is_text(key, "is_remote_frame")) return take_flag(value, frame.is_remote);
    if (is_text(key, "is_error_frame")) return take_flag(value, frame.is_error);
    if (is_text(key, "is_fd") || is_text(key, "bitrate_switch") ||
        is_text(key, "error_state_indicator")) {
      bool is_set = false;
      const bool is_flag = take_flag(value, is_set);
      is_fd = is_fd || is_set;
      return is_flag;
    }
    return key.type == Value::Type::text;
  }

  /// @returns whether they are a frame of CAN 2.0, which is then complete
  bool complete() noexcept {
    if (!has_size) size = data.size();
    if (!has_id || is_fd || size > kCanDataBytes || (frame.is_remote && frame.is_error))
      return false;
    if (!frame.is_extended && frame.id > kCanHighestId) return false;
    if (data.size() != (frame.is_remote ? 0 : size)) return false;
    frame.size = static_cast<std::uint8_t>(size);
    std::ranges::copy(data, frame.data.begin());
    return true;
  }
};

class Writer {
 public:
  explicit Writer(std::span<std::uint8_t, kLongestCanDatagram> out) noexcept : out_(out) {}

  void byte(std::uint8_t value) noexcept { out_[size_++] = value; }
  void text(std::string_view value) noexcept {
    byte(static_cast<std::uint8_t>(kFixStr + value.size()));
    for (const char letter : value) byte(static_cast<std::uint8_t>(letter));
  }
  void flag(std::string_view key, bool value) noexcept {
    text(key);
    byte(value ? kTrue : kFalse);
  }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }

 private:
  std::span<std::uint8_t, kLongestCanDatagram> out_;
  std::size_t size_ = 0;
};

}  // namespace

// The receiver replaces the time by its own.
std::size_t encode_can_datagram(const CanFrame& frame,
                                std::span<std::uint8_t, kLongestCanDatagram> out) noexcept {
  Writer to(out);
  to.byte(kFixMap + 11);
  to.text("timestamp");
  to.byte(kFloat64);
  for (int n = 0; n < 8; ++n) to.byte(0);
  to.text("arbitration_id");
  to.byte(kUint32);
  for (const unsigned shift : {24U, 16U, 8U, 0U})
    to.byte(static_cast<std::uint8_t>(frame.id >> shift));
  to.flag("is_extended_id", frame.is_extended);
  to.flag("is_remote_frame", frame.is_remote);
  to.flag("is_error_frame", frame.is_error);
  to.text("channel");
  to.byte(kNil);
  to.text("dlc");
  to.byte(std::min<std::uint8_t>(frame.size, kCanDataBytes));
  to.text("data");
  to.byte(kBin8);
  const auto data = frame.bytes();
  to.byte(static_cast<std::uint8_t>(data.size()));
  for (const std::uint8_t each : data) to.byte(each);
  to.flag("is_fd", false);
  to.flag("bitrate_switch", false);
  to.flag("error_state_indicator", false);
  return to.size();
}

bool decode_can_datagram(std::span<const std::uint8_t> bytes, CanFrame& frame) noexcept {
  Reader reader(bytes);
  std::uint64_t count = 0;
  if (!reader.read_map_size(count)) return false;
  Fields fields;
  for (; count > 0; --count) {
    Value key;
    Value value;
    if (!reader.read(key) || !reader.read(value) || !fields.take(key, value)) return false;
  }
  if (!reader.is_at_end() || !fields.complete()) return false;
  frame = fields.frame;
  return true;
}

}  // namespace torsio::detail
