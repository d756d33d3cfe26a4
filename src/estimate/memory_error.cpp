#include "torsio/estimate/memory_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace torsio::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A bound below this share of the largest one counts as 0.
constexpr double kNegligible = 1e-4;

}  // namespace

MemoryError::MemoryError(ModelMemory memory, double width, double sample_period_s, double warm_up_s)
    : memory_(std::move(memory)),
      width_(width),
      warm_up_ticks_(std::ceil(warm_up_s / sample_period_s)),
      share_(memory_.relaxations.size()) {
  double largest = 0.0;
  for (const Relaxation& each : memory_.relaxations) {
    decay_.push_back(std::exp(-sample_period_s / each.time_constant_s));
    largest += each.gain;
  }
  for (const SlipMemory& each : memory_.slips) largest += each.gain * std::min(each.travel, width_);
  negligible_ = kNegligible * largest;
  reset();
}

void MemoryError::reset() noexcept {
  std::ranges::fill(share_, 0.0);
  travel_before_ = 0.0;
  unknown_travel_ = 0.0;
  lowest_ = kInfinity;
  highest_ = -kInfinity;
  ticks_left_ = 0.0;
  bound_ = 0.0;
  is_zero_ = true;
}

void MemoryError::interrupt(double ticks, double share) noexcept {
  for (std::size_t k = 0; k < share_.size(); ++k) {
    const double kept = ticks == 1.0 ? decay_[k] : std::pow(decay_[k], ticks);
    if (share_[k] < share) share_[k] = share - (share - share_[k]) * kept;
  }
  if (highest_ >= lowest_) {  // usable ticks since the last interruption
    travel_before_ = std::max(0.0, unknown_travel_ - (highest_ - lowest_));
    unknown_travel_ = travel_before_;
  }
  unknown_travel_ = std::min(width_, std::max(unknown_travel_, travel_before_ + share * width_));
  lowest_ = kInfinity;
  highest_ = -kInfinity;
  ticks_left_ = warm_up_ticks_;
  is_zero_ = memory_.is_empty();
  update_bound();
}

void MemoryError::lose() noexcept {
  std::ranges::fill(share_, 1.0);
  interrupt(1.0);
}

void MemoryError::advance(double first_input) noexcept {
  for (std::size_t k = 0; k < share_.size(); ++k) share_[k] *= decay_[k];
  lowest_ = std::min(lowest_, first_input);
  highest_ = std::max(highest_, first_input);
  if (ticks_left_ > 0.0) ticks_left_ -= 1.0;
  update_bound();
  if (bound_ > negligible_) return;
  reset();
}

void MemoryError::update_bound() noexcept {
  bound_ = 0.0;
  if (!memory_.is_declared) {
    // Also where the time is not known (NaN).
    if (!(ticks_left_ <= 0.0)) bound_ = kInfinity;
    return;
  }
  for (std::size_t k = 0; k < share_.size(); ++k) bound_ += memory_.relaxations[k].gain * share_[k];
  const double covered = highest_ >= lowest_ ? highest_ - lowest_ : 0.0;
  for (const SlipMemory& slip : memory_.slips)
    bound_ += slip.gain * std::max(0.0, std::min({slip.travel, width_, unknown_travel_}) - covered);
}

}  // namespace torsio::detail
