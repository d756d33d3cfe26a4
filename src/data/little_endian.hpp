#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace torsio {

/// Numbers and texts one after the other in bytes, little-endian; nothing is read past the end.
class LittleEndianReader {
 public:
  static_assert(std::endian::native == std::endian::little);

  explicit LittleEndianReader(std::string_view bytes) noexcept : bytes_(bytes) {}

  [[nodiscard]] std::size_t at() const noexcept { return at_; }
  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size() - at_; }
  [[nodiscard]] std::string_view rest() const noexcept { return bytes_.substr(at_); }

  template <class Number>
    requires std::integral<Number> || std::floating_point<Number>
  [[nodiscard]] std::optional<Number> number() noexcept {
    if (left() < sizeof(Number)) return std::nullopt;
    Number value{};
    std::memcpy(&value, bytes_.data() + at_, sizeof(Number));
    at_ += sizeof(Number);
    return value;
  }

  [[nodiscard]] std::optional<std::string_view> bytes(std::size_t size) noexcept {
    if (left() < size) return std::nullopt;
    const std::string_view found = bytes_.substr(at_, size);
    at_ += size;
    return found;
  }

  /// A text whose length comes before it as a number of type `Length`.
  template <class Length>
  [[nodiscard]] std::optional<std::string_view> text() noexcept {
    const auto length = number<Length>();
    return length ? bytes(static_cast<std::size_t>(*length)) : std::nullopt;
  }

  /// To the next multiple of `size`. @returns false if that is past the end
  bool align(std::size_t size) noexcept {
    const std::size_t aligned = (at_ + size - 1) / size * size;
    if (aligned > bytes_.size()) return false;
    at_ = aligned;
    return true;
  }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

/// Appends numbers and texts to bytes, little-endian.
class LittleEndianWriter {
 public:
  static_assert(std::endian::native == std::endian::little);

  explicit LittleEndianWriter(std::string& bytes) noexcept : bytes_(bytes) {}

  template <class Number>
    requires std::integral<Number> || std::floating_point<Number>
  LittleEndianWriter& number(Number value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(Number));
    return *this;
  }
  LittleEndianWriter& bytes(std::string_view value) {
    bytes_.append(value);
    return *this;
  }
  /// A text after its length, a number of type `Length`.
  template <class Length>
  LittleEndianWriter& text(std::string_view value) {
    return number(static_cast<Length>(value.size())).bytes(value);
  }

 private:
  std::string& bytes_;
};

}  // namespace torsio
