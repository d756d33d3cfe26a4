#pragma once

#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>

#include "torsio/link/link_value.hpp"
#include "torsio/link/ndlcom_frame.hpp"

// Numbers of a payload, low byte first.

namespace torsio::detail {

static_assert(std::endian::native == std::endian::little, "payloads have the machine's byte order");

/// Writes a payload; once something does not fit, nothing more is written, and the size is 0.
class PayloadWriter {
 public:
  explicit PayloadWriter(std::span<std::uint8_t> out) noexcept : out_(out) {
    if (out_.size() > kNdlcomMaxPayloadBytes) out_ = out_.first(kNdlcomMaxPayloadBytes);
  }

  template <class T>
    requires std::is_arithmetic_v<T>
  void add(T value) noexcept {
    if (!has_space(sizeof(value))) return;
    std::memcpy(out_.data() + size_, &value, sizeof(value));
    size_ += sizeof(value);
  }
  template <class T>
    requires std::is_enum_v<T>
  void add(T value) noexcept {
    add(static_cast<std::uint8_t>(value));
  }
  void add_bytes(std::span<const std::uint8_t> bytes) noexcept {
    if (!has_space(bytes.size()) || bytes.empty()) return;
    std::memcpy(out_.data() + size_, bytes.data(), bytes.size());
    size_ += bytes.size();
  }
  /// A longer text is cut off.
  void add_text(std::string_view text, std::size_t longest) noexcept;
  void add(const LinkFloats& floats) noexcept;
  void add(const LinkValue& value) noexcept;

  [[nodiscard]] std::span<const std::uint8_t> written() const noexcept { return out_.first(size_); }
  [[nodiscard]] std::size_t size() const noexcept { return fits_ ? size_ : 0; }

 private:
  bool has_space(std::size_t bytes) noexcept {
    fits_ = fits_ && out_.size() - size_ >= bytes;
    return fits_;
  }

  std::span<std::uint8_t> out_;
  std::size_t size_ = 0;
  bool fits_ = true;
};

/// Reads a payload; the first problem is kept.
class PayloadReader {
 public:
  explicit PayloadReader(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}

  template <class T>
    requires std::is_arithmetic_v<T>
  void read(T& value) noexcept {
    if (!has(sizeof(value))) return;
    std::memcpy(&value, bytes_.data(), sizeof(value));
    bytes_ = bytes_.subspan(sizeof(value));
  }
  template <class T>
  void read_finite(T& value) noexcept {
    read(value);
    if (!std::isfinite(value)) note(LinkRefusal::not_finite);
  }
  /// @param count number of the enumeration's values
  template <class T>
    requires std::is_enum_v<T>
  void read(T& value, std::size_t count) noexcept {
    std::uint8_t number = 0;
    read(number);
    if (number >= count)
      note(LinkRefusal::unknown_value);
    else
      value = static_cast<T>(number);
  }
  void read_bytes(std::span<const std::uint8_t>& bytes) noexcept {
    bytes = bytes_;
    bytes_ = {};
  }
  void read_text(std::string_view& text, std::size_t longest) noexcept;
  void read(LinkFloats& floats) noexcept;
  void read(LinkValue& value) noexcept;

  /// All bytes must have been read.
  [[nodiscard]] LinkRefusal result() noexcept {
    if (!bytes_.empty()) note(LinkRefusal::wrong_length);
    return problem_;
  }

 private:
  bool has(std::size_t bytes) noexcept {
    if (bytes_.size() < bytes) note(LinkRefusal::wrong_length);
    return bytes_.size() >= bytes;
  }
  void note(LinkRefusal problem) noexcept {
    if (problem_ == LinkRefusal::none) problem_ = problem;
  }

  std::span<const std::uint8_t> bytes_;
  LinkRefusal problem_ = LinkRefusal::none;
};

}  // namespace torsio::detail
