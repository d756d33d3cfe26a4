#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "torsio/core/realtime.hpp"

namespace torsio {

/// Bytes per second of an asynchronous serial line with 8N1: ten bits per byte.
[[nodiscard]] constexpr double serial_B_s(double baud) noexcept { return baud / 10.0; }

/// Bytes on the line, on average, of a frame with telemetry: two flags, header, CRC and payload, of which two bytes in 256
/// are escaped. A frame of the worst case is twice as long; `LineBudget` keeps a tenth of the line free for it and for replies.
[[nodiscard]] double telemetry_frame_bytes(std::size_t channels) noexcept TORSIO_REALTIME;

/// Which telemetry a line carries.
class LineBudget {
 public:
  static constexpr double kUsable = 0.9;

  /// @param line_B_s bytes per second; infinite: no limit, as for UDP
  explicit LineBudget(double line_B_s = std::numeric_limits<double>::infinity()) noexcept
      : line_B_s_(line_B_s) {}

  struct Verdict {
    bool fits = false;
    double asked_B_s = 0.0;      ///< with this subscription
    double available_B_s = 0.0;  ///< nine tenths of the line
  };
  /// @param others_B_s of all other subscriptions
  [[nodiscard]] Verdict check(double others_B_s, std::size_t channels,
                              double rate_Hz) const noexcept TORSIO_REALTIME;

 private:
  double line_B_s_;
};

/// Bytes that may be sent at once and per second: paces a line that has no baud rate of its own, such as a pseudo-terminal.
///
///     b(t) = min(burst, b + rate Δt) - sent
class TokenBucket {
 public:
  /// @throws Error if a value is not positive
  TokenBucket(double rate_B_s, double burst_B);

  /// @returns whether `bytes` may be sent now; they then count as sent
  [[nodiscard]] bool take(std::size_t bytes, std::uint64_t now_ns) noexcept TORSIO_REALTIME;
  /// Until when to wait before `take(bytes)` succeeds [ns]; 0: now. More than the burst never does: the largest number.
  [[nodiscard]] std::uint64_t wait_ns(std::size_t bytes,
                                      std::uint64_t now_ns) noexcept TORSIO_REALTIME;

 private:
  void fill(std::uint64_t now_ns) noexcept;

  double rate_B_s_;
  double burst_B_;
  double level_B_;
  std::uint64_t last_ns_ = 0;
};

}  // namespace torsio
