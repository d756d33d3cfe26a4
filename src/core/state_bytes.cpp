#include "torsio/core/state_bytes.hpp"

#include <array>
#include <bit>
#include <cstring>

namespace torsio::detail {
namespace {

/// "torsioS1" on a little-endian machine; another byte order gives another number.
constexpr std::uint64_t kMagic = 0x31536f6973726f74U;

std::uint64_t checksum(std::span<const std::byte> bytes) noexcept {
  StateHash hash;
  hash.add_bytes(bytes.data(), bytes.size());
  return hash.value();
}

/// Most members are one number: a call of memcpy for each would take most of the time.
void copy(void* to, const void* from, std::size_t size) noexcept {
  if (size == sizeof(double)) {
    std::memcpy(to, from, sizeof(double));
  } else if (size == 1) {
    std::memcpy(to, from, 1);
  } else {
    std::memcpy(to, from, size);
  }
}

}  // namespace

void StateBytes::visit_raw(void* data, std::size_t size) noexcept {
  if (task_ == Task::list) return add_segment(data, size, StateSegment::Kind::bytes);
  const std::size_t from = position_;
  position_ += size;
  if (task_ == Task::count || size == 0) return;
  if (position_ > size_) return fail();
  if (task_ == Task::write) copy(target_ + from, data, size);
  if (task_ == Task::read) copy(data, source_ + from, size);
}

void StateBytes::add_segment(void* member, std::size_t size, StateSegment::Kind kind) noexcept {
  if (size > 0)
    segments_->push_back({.member = member, .size = size, .offset = position_, .kind = kind});
  position_ += size;
}

void StateSegments::read(std::span<const std::byte> bytes) const noexcept {
  for (const StateSegment& segment : segments_) {
    const std::byte* const from = bytes.data() + segment.offset;
    if (segment.kind == StateSegment::Kind::bytes) {
      copy(segment.member, from, segment.size);
    } else {
      std::memcpy(segment.member, from,  // little-endian: the low bytes come first
                  segment.kind == StateSegment::Kind::flag ? 1 : sizeof(std::uint64_t));
    }
  }
}

void StateSegments::write(std::span<std::byte> bytes) const noexcept {
  for (const StateSegment& segment : segments_) {
    std::byte* const to = bytes.data() + segment.offset;
    if (segment.kind == StateSegment::Kind::bytes) {
      copy(to, segment.member, segment.size);
    } else {
      std::uint64_t value = 0;
      std::memcpy(&value, segment.member,
                  segment.kind == StateSegment::Kind::flag ? 1 : sizeof value);
      std::memcpy(to, &value, sizeof value);
    }
  }
}

void StateBytes::peek(void* data, std::size_t size) const noexcept {
  if (size_ >= size && position_ <= size_ - size) std::memcpy(data, source_ + position_, size);
}

void StateHash::add(std::uint64_t word) noexcept {
  value_ = std::rotl((value_ ^ word) * 0x9e3779b97f4a7c15U, 29) * 0xbf58476d1ce4e5b9U;
}

void StateHash::add_bytes(const void* data, std::size_t size) noexcept {
  const auto* const bytes = static_cast<const std::byte*>(data);
  std::size_t at = 0;
  for (; at + sizeof(std::uint64_t) <= size; at += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + at, sizeof word);
    add(word);
  }
  std::uint64_t rest = size;
  for (; at < size; ++at) rest = rest << 8U | std::to_integer<std::uint64_t>(bytes[at]);
  add(rest);
}

void write_state_header(std::span<std::byte> bytes, std::uint64_t identity) noexcept {
  const std::array<std::uint64_t, 4> header{kMagic, identity, bytes.size() - kStateHeaderBytes,
                                            checksum(bytes.subspan(kStateHeaderBytes))};
  static_assert(sizeof header == kStateHeaderBytes);
  std::memcpy(bytes.data(), header.data(), sizeof header);
}

bool is_state_of(std::span<const std::byte> bytes, std::uint64_t identity) noexcept {
  std::array<std::uint64_t, 4> header{};
  if (bytes.size() < sizeof header) return false;
  std::memcpy(header.data(), bytes.data(), sizeof header);
  return header[0] == kMagic && header[1] == identity &&
         header[2] == bytes.size() - kStateHeaderBytes &&
         header[3] == checksum(bytes.subspan(kStateHeaderBytes));
}

}  // namespace torsio::detail
