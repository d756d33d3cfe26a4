#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"

namespace torsio::detail {

/// Whether a loop runs at the sample period that it was configured for, from the time stamps of its
/// ticks: it does not where more than half of the last 32 periods are too long, or more than half too
/// short, by more than `kTolerance`; so the median is off by as much. A single late tick is not an error.
class PeriodCheck {
 public:
  static constexpr double kTolerance = 0.2;  ///< share of the period
  static constexpr int kPeriods = 32;

  explicit PeriodCheck(double period_s)
      : shortest_s_((1.0 - kTolerance) * period_s), longest_s_((1.0 + kTolerance) * period_s) {}

  void reset() noexcept {
    too_short_ = 0;
    too_long_ = 0;
    has_last_ = false;
  }

  /// @param t_s of this tick; NaN, or before the last one: the check starts again.
  /// @returns whether the rate is wrong
  bool step(double t_s) noexcept TORSIO_REALTIME {
    const double period_s = t_s - last_s_;
    last_s_ = t_s;
    if (!has_last_ || !(period_s >= 0.0)) {
      reset();
      has_last_ = !std::isnan(t_s);
      return false;
    }
    too_short_ = too_short_ << 1U | static_cast<std::uint32_t>(period_s < shortest_s_);
    too_long_ = too_long_ << 1U | static_cast<std::uint32_t>(period_s > longest_s_);
    return std::popcount(too_short_) > kPeriods / 2 || std::popcount(too_long_) > kPeriods / 2;
  }

  /// The members that change in a step.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(last_s_, too_short_, too_long_, has_last_);
  }

 private:
  double shortest_s_;
  double longest_s_;
  double last_s_ = 0.0;
  std::uint32_t too_short_ = 0;  ///< one bit per period, the newest last
  std::uint32_t too_long_ = 0;
  bool has_last_ = false;
};

}  // namespace torsio::detail
