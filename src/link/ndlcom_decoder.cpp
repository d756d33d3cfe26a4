#include <algorithm>
#include <utility>

#include "link/copy_plain.hpp"
#include "link/frame_crc.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio {

namespace {

static_assert(detail::kPlainBlock == 16);

/// Whether the strict rules permit this byte after 7D.
bool is_escape(std::uint8_t byte) noexcept {
  const auto meant = static_cast<std::uint8_t>(byte ^ detail::kEscapeBit);
  return meant == detail::kFlag || meant == detail::kEscape;
}

}  // namespace

void NdlcomDecoder::reset() noexcept {
  size_ = 0;
  has_discarded_ = false;
  phase_ = rules_ == NdlcomRules::strict ? Phase::searching : Phase::inside;
}

std::optional<NdlcomFrame> NdlcomDecoder::next(std::span<const std::uint8_t>& bytes) noexcept {
  return rules_ == NdlcomRules::strict ? next_strict(bytes) : next_lenient(bytes);
}

/// Stores what precedes the next 7E or 7D, up to one byte more than a frame may have.
void NdlcomDecoder::copy_run(const std::uint8_t*& at, const std::uint8_t* end) noexcept {
  while (end - at >= static_cast<std::ptrdiff_t>(kCopied) && size_ <= kNdlcomMaxDecodedBytes) {
    const std::size_t plain = detail::first_of(detail::copy_block(at, frame() + size_));
    at += plain;
    size_ += plain;
    if (plain < kCopied) return;
  }
  while (at != end && size_ <= kNdlcomMaxDecodedBytes && *at != detail::kFlag &&
         *at != detail::kEscape)
    frame()[size_++] = *at++;
}

/// Whole escapes, one after the other, which are slow as ends of runs.
void NdlcomDecoder::take_escapes(const std::uint8_t*& at, const std::uint8_t* end) noexcept {
  while (end - at >= 2 && *at == detail::kEscape && size_ <= kNdlcomMaxDecodedBytes) {
    if (!is_escape(at[1])) return;
    frame()[size_++] = static_cast<std::uint8_t>(at[1] ^ detail::kEscapeBit);
    at += 2;
  }
}

/// What was received since the flag is not a frame.
void NdlcomDecoder::discard() noexcept {
  ++counts_.malformed;
  phase_ = Phase::searching;
  has_discarded_ = true;
  size_ = 0;
}

std::optional<NdlcomFrame> NdlcomDecoder::checked() noexcept {
  const std::size_t size = std::exchange(size_, 0);
  // A text with its CRC has the CRC 0.
  if (detail::frame_crc(frame(), size) != 0) {
    ++counts_.crc_errors;
    return std::nullopt;
  }
  ++counts_.frames;
  const std::uint8_t* const bytes = frame();
  return NdlcomFrame{.receiver = bytes[0],
                     .sender = bytes[1],
                     .counter = bytes[2],
                     .payload = {bytes + kNdlcomHeaderBytes, bytes[3]}};
}

/// At a flag that ends a frame, and may begin the next.
std::optional<NdlcomFrame> NdlcomDecoder::finish() noexcept {
  if (size_ == 0) return std::nullopt;  // two flags in a row
  if (size_ != kNdlcomHeaderBytes + 2U + frame()[3]) {
    ++counts_.malformed;
    size_ = 0;
    return std::nullopt;
  }
  return checked();
}

std::optional<NdlcomFrame> NdlcomDecoder::next_strict(
    std::span<const std::uint8_t>& bytes) noexcept {
  const std::uint8_t* at = bytes.data();
  const std::uint8_t* const end = at + bytes.size();
  std::optional<NdlcomFrame> found;
  while (at != end && !found) {
    if (phase_ == Phase::searching) {
      const std::uint8_t* const flag = std::find(at, end, detail::kFlag);
      has_discarded_ = has_discarded_ || flag != at;
      at = flag;
      if (at == end) break;
      ++at;
      counts_.resynchronisations += has_discarded_ ? 1U : 0U;
      has_discarded_ = false;
      phase_ = Phase::inside;
      continue;
    }
    if (phase_ == Phase::escaped) {
      if (!is_escape(*at)) {
        discard();  // the byte, too, is discarded, unless it is a flag
        continue;
      }
      frame()[size_++] = static_cast<std::uint8_t>(*at++ ^ detail::kEscapeBit);
      phase_ = Phase::inside;
    } else {
      copy_run(at, end);
      take_escapes(at, end);
      if (at != end && size_ <= kNdlcomMaxDecodedBytes) {
        if (*at == detail::kFlag) {
          ++at;
          found = finish();
        } else if (*at == detail::kEscape && end - at == 1) {
          ++at;
          phase_ = Phase::escaped;
        } else if (*at == detail::kEscape && !is_escape(at[1])) {
          ++at;
          discard();
        }
        continue;
      }
    }
    if (size_ > kNdlcomMaxDecodedBytes) discard();
  }
  bytes = bytes.subspan(static_cast<std::size_t>(at - bytes.data()));
  return found;
}

std::optional<NdlcomFrame> NdlcomDecoder::next_lenient(
    std::span<const std::uint8_t>& bytes) noexcept {
  std::size_t taken = 0;
  std::optional<NdlcomFrame> found;
  while (taken < bytes.size() && !found) {
    std::uint8_t byte = bytes[taken++];
    if (byte == detail::kFlag) {
      counts_.malformed += size_ > 0 ? 1U : 0U;
      size_ = 0;
      phase_ = Phase::inside;
      continue;
    }
    if (phase_ == Phase::escaped) {
      byte ^= detail::kEscapeBit;
    } else if (byte == detail::kEscape) {
      phase_ = Phase::escaped;
      continue;
    }
    phase_ = Phase::inside;
    frame()[size_++] = byte;
    if (size_ >= kNdlcomHeaderBytes + 2 && size_ == kNdlcomHeaderBytes + 2U + frame()[3])
      found = checked();
  }
  bytes = bytes.subspan(taken);
  return found;
}

}  // namespace torsio
