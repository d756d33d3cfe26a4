#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "torsio/core/realtime.hpp"

namespace torsio {

inline constexpr std::uint8_t kNdlcomBroadcast = 0xFF;  ///< receiver: every device of the bus
inline constexpr std::uint8_t kNdlcomReserved = 0x00;   ///< as sender or receiver: not a device
inline constexpr std::size_t kNdlcomHeaderBytes = 4;
inline constexpr std::size_t kNdlcomMaxPayloadBytes = 255;
inline constexpr std::size_t kNdlcomMaxDecodedBytes =
    kNdlcomHeaderBytes + kNdlcomMaxPayloadBytes + 2;
/// Two flags, and every other byte escaped.
inline constexpr std::size_t kNdlcomMaxEncodedBytes = 2 + 2 * kNdlcomMaxDecodedBytes;

/// A frame of NDLCom, before escaping and without its CRC:
///
///     receiver, sender, counter, length of the payload, payload (0 to 255 bytes)
///
/// Source: github.com/t0beers/ndlcom, commit 7a496f9 (format only; the code is our own).
struct NdlcomFrame {
  std::uint8_t receiver = kNdlcomReserved;
  std::uint8_t sender = kNdlcomReserved;
  std::uint8_t counter = 0;  ///< per receiver at the sender; wraps after 255
  std::span<const std::uint8_t> payload = {};
};

/// CRC-16/MCRF4XX: polynomial 0x1021 reflected (0x8408), start 0xFFFF, no final inversion. The ASCII text "123456789" has
/// 0x6F91, and a text followed by its CRC, low byte first, has 0. Slicing-by-16 (8 KiB of tables); inside
/// the codec products without carries, where the processor has them.
/// @param before CRC of what precedes `bytes`
[[nodiscard]] std::uint16_t ndlcom_crc(std::span<const std::uint8_t> bytes,
                                       std::uint16_t before = 0xFFFF) noexcept TORSIO_REALTIME;

/// Writes 7E, the frame and its CRC (low byte first), 7E. Between the flags 7E and 7D become 7D 5E and 7D 5D; the CRC is
/// that before escaping.
/// @returns the number of bytes in `out`; 0 if the payload is longer than 255 bytes or `out` too short. An `out` of
/// `kNdlcomMaxEncodedBytes` is sufficient for every frame.
[[nodiscard]] std::size_t encode_ndlcom(const NdlcomFrame& frame,
                                        std::span<std::uint8_t> out) noexcept TORSIO_REALTIME;

/// Which byte sequences are frames. `lenient` is what the public parser accepts.
enum class NdlcomRules : std::uint8_t {
  /// Between two flags, which two frames may share; as long as the header states; after 7D only 5D or 5E.
  strict,
  /// A frame ends where its length ends, flag or not, and the next may begin there; 7E begins a frame; 7D inverts bit 5 of
  /// any byte.
  lenient,
};

/// Frames from a stream of bytes that arrives in parts of any size. No heap, and at most `kNdlcomMaxDecodedBytes` are
/// stored; nothing that was received can do more than increase a count.
///
///     while (const auto frame = decoder.next(bytes)) ...
///
/// With the strict rules 1, 2 and 3 wrong bits and bursts of up to 16 bits were never accepted in tests, whereas the
/// lenient ones accept some: a wrong bit in the length moves the end.
class NdlcomDecoder {
 public:
  struct Counts {
    std::uint64_t frames = 0;      ///< accepted
    std::uint64_t crc_errors = 0;  ///< right in form, with another CRC
    std::uint64_t malformed =
        0;  ///< too short or too long, another length than stated, an escape that is not permitted
    std::uint64_t resynchronisations =
        0;  ///< strict: bytes were discarded until a flag, at the start or after a mistake
  };

  explicit NdlcomDecoder(NdlcomRules rules = NdlcomRules::strict) noexcept : rules_(rules) {
    reset();
  }

  /// As at the start, with the counts kept: for a new connection.
  void reset() noexcept TORSIO_REALTIME;

  /// Takes bytes up to the end of the next frame, and removes them from `bytes`.
  /// @returns the frame, valid until the next call; none if all bytes were taken first
  [[nodiscard]] std::optional<NdlcomFrame> next(std::span<const std::uint8_t>& bytes) noexcept
      TORSIO_REALTIME;

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  enum class Phase : std::uint8_t { searching, inside, escaped };
  /// Bytes that are stored at once, the last of them perhaps in vain; zeros before the frame, for its CRC.
  static constexpr std::size_t kCopied = 16;

  std::optional<NdlcomFrame> next_strict(std::span<const std::uint8_t>& bytes) noexcept;
  std::optional<NdlcomFrame> next_lenient(std::span<const std::uint8_t>& bytes) noexcept;
  void copy_run(const std::uint8_t*& at, const std::uint8_t* end) noexcept;
  void take_escapes(const std::uint8_t*& at, const std::uint8_t* end) noexcept;
  void discard() noexcept;
  std::optional<NdlcomFrame> finish() noexcept;
  std::optional<NdlcomFrame> checked() noexcept;

  [[nodiscard]] std::uint8_t* frame() noexcept { return buffer_.data() + kCopied; }

  NdlcomRules rules_;
  Phase phase_ = Phase::searching;
  bool has_discarded_ = false;  ///< while searching: at least one byte
  std::size_t size_ = 0;        ///< bytes so far
  Counts counts_ = {};
  std::array<std::uint8_t, kCopied + kNdlcomMaxDecodedBytes + kCopied> buffer_ = {};
};

}  // namespace torsio
