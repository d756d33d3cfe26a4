#include "data/arrays/mat_check.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMatHeaderBytes = 128;
constexpr std::size_t kElementTagBytes = 8;
constexpr std::size_t kDeepestArray = 64;

// Kinds of elements.
constexpr std::uint32_t kArrayElement = 14;
constexpr std::uint32_t kPackedElement = 15;
constexpr std::array<std::uint64_t, 19> kBytesOfKind{0, 1, 1, 2, 2, 4, 4, 4, 0, 8,
                                                     0, 0, 8, 8, 0, 0, 1, 2, 4};
// Classes of arrays.
constexpr std::uint32_t kCellArray = 1;
constexpr std::uint32_t kStructArray = 2;
constexpr std::uint32_t kFirstNumeric = 6;
constexpr std::uint32_t kLastNumeric = 15;
constexpr std::uint32_t kIsComplex = 0x800;

/// Elements within bytes, of either byte order.
class Elements {
 public:
  struct Element {
    std::uint32_t kind = 0;
    std::string_view content;
  };

  Elements(std::string_view bytes, bool is_swapped) : bytes_(bytes), is_swapped_(is_swapped) {}

  [[nodiscard]] bool is_at_end() const noexcept { return bytes_.empty(); }

  /// @returns false if the next element does not end within the bytes
  [[nodiscard]] bool next(Element& element) {
    if (bytes_.size() < kElementTagBytes) return false;
    const std::uint32_t first = number(bytes_, 0);
    if (const std::uint32_t small = first >> 16U; small != 0) {
      if (small > kElementTagBytes / 2) return false;
      element = {first & 0xFFFFU, bytes_.substr(kElementTagBytes / 2, small)};
      bytes_.remove_prefix(kElementTagBytes);
      return true;
    }
    const std::size_t size = number(bytes_, kElementTagBytes / 2);
    if (size > bytes_.size() - kElementTagBytes) return false;
    element = {first, bytes_.substr(kElementTagBytes, size)};
    // The next one begins at a multiple of eight; the last may end without the gap.
    const std::size_t padded = kElementTagBytes + (size + 7) / 8 * 8;
    bytes_.remove_prefix(std::min(padded, bytes_.size()));
    return true;
  }

  [[nodiscard]] std::uint32_t number(std::string_view bytes, std::size_t at) const {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof(value));
    return is_swapped_ ? __builtin_bswap32(value) : value;
  }

 private:
  std::string_view bytes_;
  bool is_swapped_;
};

class MatVerifier {
 public:
  MatVerifier(const PlacedBytes& bytes, ReadBudget& budget) : bytes_(bytes), budget_(budget) {}

  void verify() {
    budget_.read_to(bytes_.size());
    const std::string head = bytes_.at(0, kMatHeaderBytes);
    if (head.size() < kMatHeaderBytes || !head.starts_with("MATLAB 5.0 MAT")) {
      if (!head.starts_with("MATLAB") && !head.starts_with("\x89HDF")) verify_version_4();
      return;
    }
    const std::string_view order = std::string_view(head).substr(kMatHeaderBytes - 2);
    if (order != "IM" && order != "MI") refuse(kMatHeaderBytes - 2, "neither 'IM' nor 'MI'");
    is_swapped_ = order == "MI";
    for (std::uint64_t at = kMatHeaderBytes; at < bytes_.size();) at = verify_variable(at);
  }

 private:
  [[noreturn]] void refuse(std::uint64_t place, const std::string& problem) const {
    throw Error({.place = fmt::format("{}: byte {}", budget_.name(), place),
                 .problem = problem,
                 .expected = "a MATLAB file",
                 .advice = "The file is damaged or truncated: copy or export it again."});
  }

  /// @returns where the next one begins
  std::uint64_t verify_variable(std::uint64_t at) {
    const std::string tag = bytes_.at(at, kElementTagBytes);
    if (tag.size() < kElementTagBytes) refuse(at, "it ends in the middle of a variable");
    const Elements reader({}, is_swapped_);
    const std::uint32_t kind = reader.number(tag, 0);
    const std::uint64_t size = reader.number(tag, kElementTagBytes / 2);
    if (kind != kArrayElement && kind != kPackedElement)
      refuse(at, fmt::format("an element of kind {}", kind));
    if (size > bytes_.size() - at - kElementTagBytes)
      refuse(at, "it ends in the middle of a variable");
    budget_.require(size);
    const std::string content = bytes_.at(at + kElementTagBytes, size);
    budget_.work(1 + content.size() / kElementTagBytes);
    if (kind == kArrayElement)
      verify_matrix(content, at, 0);
    else
      verify_packed(content, at);
    return at + kElementTagBytes + size;
  }

  void verify_packed(const std::string& packed, std::uint64_t at) {
    const std::string content = unpacked(packed, at);
    Elements elements(content, is_swapped_);
    Elements::Element matrix;
    if (!elements.next(matrix) || matrix.kind != kArrayElement || !elements.is_at_end())
      refuse(at, "a packed variable without an array");
    verify_matrix(matrix.content, at, 0);
  }

  /// zlib compares the checksum at the end.
  std::string unpacked(const std::string& packed, std::uint64_t at) {
    constexpr std::size_t kBlock = std::size_t{1} << 16;
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) refuse(at, "zlib cannot start");
    std::string content;
    std::string_view left = packed;
    int code = Z_OK;
    while (code == Z_OK) {
      const std::size_t taken = std::min<std::size_t>(left.size(), kBlock);
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(left.data()));
      stream.avail_in = static_cast<uInt>(taken);
      const std::size_t before = content.size();
      if (before + kBlock > budget_.memory_limit()) break;
      content.resize(before + kBlock);
      stream.next_out = reinterpret_cast<Bytef*>(content.data() + before);
      stream.avail_out = static_cast<uInt>(kBlock);
      code = inflate(&stream, Z_NO_FLUSH);
      content.resize(content.size() - stream.avail_out);
      left.remove_prefix(taken - stream.avail_in);
    }
    inflateEnd(&stream);
    budget_.require(content.size() + kBlock);
    budget_.work(content.size() / kElementTagBytes);
    if (code != Z_STREAM_END || !left.empty())
      refuse(at, "the checksum of a packed variable is wrong, or it is damaged");
    return content;
  }

  void verify_matrix(std::string_view content, std::uint64_t at, std::size_t depth) {
    if (content.empty()) return;  // an empty part of a structure
    if (depth > kDeepestArray) refuse(at, "arrays nested too deeply");
    Elements elements(content, is_swapped_);
    Elements::Element flags;
    Elements::Element dimensions;
    Elements::Element name;
    if (!elements.next(flags) || flags.content.size() < kElementTagBytes)
      refuse(at, "a variable without flags");
    const std::uint32_t word = elements.number(flags.content, 0);
    const std::uint32_t type = word & 0xFFU;
    if (type != kCellArray && type != kStructArray &&
        (type < kFirstNumeric || type > kLastNumeric)) {
      verify_rest(elements, at);
      return;
    }
    if (!elements.next(dimensions) || !elements.next(name)) refuse(at, "a variable without name");
    std::uint64_t count = 1;
    for (std::size_t i = 0; i + sizeof(std::uint32_t) <= dimensions.content.size();
         i += sizeof(std::uint32_t))
      if (__builtin_mul_overflow(count, elements.number(dimensions.content, i), &count))
        refuse(at, "impossible dimensions");
    if (type == kCellArray || type == kStructArray) {
      verify_parts(elements, at, depth, type == kStructArray);
      return;
    }
    const int parts = (word & kIsComplex) != 0 ? 2 : 1;
    for (int part = 0; part < parts; ++part) {
      Elements::Element values;
      if (!elements.next(values)) refuse(at, "it ends in the middle of a variable");
      const std::uint64_t each =
          values.kind < kBytesOfKind.size() ? kBytesOfKind.at(values.kind) : 0;
      if (each == 0 || count > values.content.size() / each ||
          values.content.size() != count * each)
        refuse(at,
               fmt::format("{} bytes for an array of {} numbers", values.content.size(), count));
    }
    if (!elements.is_at_end()) refuse(at, "bytes after the numbers of an array");
  }

  void verify_rest(Elements& elements, std::uint64_t at) {
    Elements::Element element;
    while (!elements.is_at_end())
      if (!elements.next(element)) refuse(at, "it ends in the middle of a variable");
  }

  void verify_parts(Elements& elements, std::uint64_t at, std::size_t depth, bool is_struct) {
    Elements::Element element;
    if (is_struct)  // the length of the names, and the names
      for (int i = 0; i < 2; ++i)
        if (!elements.next(element)) refuse(at, "a structure without names");
    while (!elements.is_at_end()) {
      budget_.work(1);
      if (!elements.next(element) || element.kind != kArrayElement)
        refuse(at, "it ends in the middle of a variable");
      verify_matrix(element.content, at, depth + 1);
    }
  }

  /// Five numbers, a name, and the values of each variable.
  void verify_version_4() const {
    constexpr std::size_t kHead = 20;
    constexpr std::array<std::uint64_t, 6> kBytes{8, 4, 4, 2, 2, 1};
    for (std::uint64_t at = 0; at < bytes_.size();) {
      budget_.work(1);
      const std::string head = bytes_.at(at, kHead);
      if (head.size() < kHead) refuse(at, "it ends in the middle of a variable");
      std::array<std::uint32_t, 5> numbers{};
      std::memcpy(numbers.data(), head.data(), kHead);
      constexpr std::uint32_t kLargestType = 5000;
      if (numbers[0] > kLargestType)
        for (std::uint32_t& number : numbers) number = __builtin_bswap32(number);
      const std::uint32_t kind = numbers[0] / 10 % 10;
      if (numbers[0] > kLargestType || kind >= kBytes.size()) refuse(at, "neither version 4 nor 5");
      std::uint64_t size = 0;
      if (__builtin_mul_overflow(std::uint64_t{numbers[1]} * kBytes.at(kind),
                                 std::uint64_t{numbers[2]} * (numbers[3] != 0 ? 2U : 1U), &size) ||
          size > bytes_.size() || at + kHead + numbers[4] > bytes_.size() - size)
        refuse(at, "it ends in the middle of a variable");
      at += kHead + numbers[4] + size;
    }
  }

  const PlacedBytes& bytes_;
  ReadBudget& budget_;
  bool is_swapped_ = false;
};

}  // namespace

void verify_mat(const PlacedBytes& bytes, ReadBudget& budget) {
  MatVerifier(bytes, budget).verify();
}

}  // namespace torsio
