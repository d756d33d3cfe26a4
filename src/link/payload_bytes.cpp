#include "link/payload_bytes.hpp"

#include <algorithm>

namespace torsio::detail {

void PayloadWriter::add_text(std::string_view text, std::size_t longest) noexcept {
  text = text.substr(0, longest);
  add(static_cast<std::uint8_t>(text.size()));
  add_bytes({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

void PayloadWriter::add(const LinkFloats& floats) noexcept {
  const auto count = static_cast<std::uint8_t>(std::min<std::size_t>(floats.count, kLinkChannels));
  add(count);
  for (std::size_t k = 0; k < count; ++k) add(floats.values[k]);
}

void PayloadWriter::add(const LinkValue& value) noexcept {
  add(value.type);
  switch (value.type) {
    case LinkValueType::boolean: return add(static_cast<std::uint8_t>(value.boolean ? 1 : 0));
    case LinkValueType::int32: return add(value.int32);
    case LinkValueType::uint32: return add(value.uint32);
    case LinkValueType::float64: return add(value.float64);
    case LinkValueType::text: return add_text(value.text, kLongestLinkText);
  }
}

void PayloadReader::read_text(std::string_view& text, std::size_t longest) noexcept {
  std::uint8_t size = 0;
  read(size);
  if (size > longest) note(LinkRefusal::wrong_length);
  if (!has(size)) return;
  text = {reinterpret_cast<const char*>(bytes_.data()), size};
  bytes_ = bytes_.subspan(size);
}

void PayloadReader::read(LinkFloats& floats) noexcept {
  read(floats.count);
  if (floats.count > kLinkChannels) {
    note(LinkRefusal::wrong_length);
    floats.count = 0;
  }
  for (std::size_t k = 0; k < floats.count; ++k) read(floats.values[k]);
}

void PayloadReader::read(LinkValue& value) noexcept {
  read(value.type, kLinkValueTypes);
  switch (value.type) {
    case LinkValueType::boolean: {
      std::uint8_t number = 0;
      read(number);
      if (number > 1) note(LinkRefusal::unknown_value);
      value.boolean = number == 1;
      return;
    }
    case LinkValueType::int32: return read(value.int32);
    case LinkValueType::uint32: return read(value.uint32);
    case LinkValueType::float64: return read(value.float64);
    case LinkValueType::text: return read_text(value.text, kLongestLinkText);
  }
}

}  // namespace torsio::detail
