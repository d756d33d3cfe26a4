#include "torsio/link/line_budget.hpp"

#include <algorithm>
#include <cmath>

#include "core/checks.hpp"
#include "torsio/link/ndlcom_frame.hpp"

namespace torsio {
namespace {

constexpr double kEscapedShare = 2.0 / 256.0;
constexpr double kTelemetryBytes =
    19.0;  // id, version, time, sequence, mask and count of LinkTelemetry

}  // namespace

double telemetry_frame_bytes(std::size_t channels) noexcept {
  const double decoded =
      kTelemetryBytes + 4.0 * static_cast<double>(channels) + double{kNdlcomHeaderBytes} + 2.0;
  return 2.0 + decoded * (1.0 + kEscapedShare);
}

LineBudget::Verdict LineBudget::check(double others_B_s, std::size_t channels,
                                      double rate_Hz) const noexcept {
  const double asked_B_s = others_B_s + rate_Hz * telemetry_frame_bytes(channels);
  const double available_B_s = kUsable * line_B_s_;
  return {
      .fits = asked_B_s <= available_B_s, .asked_B_s = asked_B_s, .available_B_s = available_B_s};
}

TokenBucket::TokenBucket(double rate_B_s, double burst_B)
    : rate_B_s_(rate_B_s), burst_B_(burst_B), level_B_(burst_B) {
  require_positive("token bucket", "the rate in bytes per second", rate_B_s);
  require_positive("token bucket", "the burst in bytes", burst_B);
}

void TokenBucket::fill(std::uint64_t now_ns) noexcept {
  if (last_ns_ != 0 && now_ns > last_ns_)
    level_B_ =
        std::min(burst_B_, level_B_ + 1e-9 * rate_B_s_ * static_cast<double>(now_ns - last_ns_));
  last_ns_ = std::max(last_ns_, now_ns);
}

bool TokenBucket::take(std::size_t bytes, std::uint64_t now_ns) noexcept {
  fill(now_ns);
  const auto wanted_B = static_cast<double>(bytes);
  if (wanted_B > level_B_) return false;
  level_B_ -= wanted_B;
  return true;
}

std::uint64_t TokenBucket::wait_ns(std::size_t bytes, std::uint64_t now_ns) noexcept {
  fill(now_ns);
  const auto wanted_B = static_cast<double>(bytes);
  if (wanted_B > burst_B_) return std::numeric_limits<std::uint64_t>::max();
  if (wanted_B <= level_B_) return 0;
  return static_cast<std::uint64_t>(std::ceil((wanted_B - level_B_) / rate_B_s_ * 1e9));
}

}  // namespace torsio
