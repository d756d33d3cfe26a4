#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "estimate/guard_listing.hpp"
#include "torsio/estimate/estimator_core.hpp"

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
      share_(memory_.relaxations.size()),
      others_(memory_.slips.size()) {
  double largest = 0.0;
  for (const Relaxation& each : memory_.relaxations) {
    decay_.push_back(std::exp(-sample_period_s / each.time_constant_s));
    largest += each.gain;
  }
  for (const SlipMemory& each : memory_.slips)
    largest += each.gain * (each.input == 0 ? std::min(each.travel, width_) : each.travel);
  negligible_ = kNegligible * largest;
  reset();
}

void MemoryError::reset() noexcept {
  std::ranges::fill(share_, 0.0);
  travel_before_ = 0.0;
  unknown_travel_ = 0.0;
  lowest_ = kInfinity;
  highest_ = -kInfinity;
  std::ranges::fill(others_, Travel{});
  ticks_left_ = 0.0;
  bound_ = 0.0;
  is_zero_ = true;
}

void MemoryError::raise_share(std::size_t relaxation, double towards, double ticks) noexcept {
  double& share = share_[relaxation];
  if (!(share < towards)) return;
  const double decay = decay_[relaxation];
  share = towards - (towards - share) * (ticks == 1.0 ? decay : std::pow(decay, ticks));
}

void MemoryError::interrupt(double ticks, double share, bool others) noexcept {
  for (std::size_t k = 0; k < share_.size(); ++k) {
    const bool is_first = memory_.relaxations[k].input == 0;
    raise_share(k, others ? 1.0 : (is_first ? share : 0.0), ticks);
  }
  lose_travel(share, others);
}

void MemoryError::doubt(double ticks, double share) noexcept {
  for (std::size_t k = 0; k < share_.size(); ++k)
    raise_share(k, memory_.relaxations[k].input == 0 ? share : std::min(share, 1.0), ticks);
  lose_travel(std::min(share, 1.0), true);
}

void MemoryError::lose_travel(double share, bool others) noexcept {
  if (highest_ >= lowest_) {  // usable ticks since the last interruption
    travel_before_ = std::max(0.0, unknown_travel_ - (highest_ - lowest_));
    unknown_travel_ = travel_before_;
  }
  unknown_travel_ = std::min(width_, std::max(unknown_travel_, travel_before_ + share * width_));
  lowest_ = kInfinity;
  highest_ = -kInfinity;
  for (std::size_t i = 0; others && i < others_.size(); ++i)
    others_[i] = {.lowest = kInfinity, .highest = -kInfinity, .unknown = memory_.slips[i].travel};
  ticks_left_ = warm_up_ticks_;
  is_zero_ = memory_.is_empty();
  update_bound();
}

void MemoryError::miss_others(std::span<const double> missed,
                              std::span<const double> widths) noexcept {
  for (std::size_t k = 0; k < share_.size(); ++k)
    if (const std::size_t input = memory_.relaxations[k].input; input > 0 && missed[input] > 0.0)
      share_[k] = std::max(share_[k], std::min(1.0, missed[input] / widths[input]));
  for (std::size_t i = 0; i < others_.size(); ++i) {
    const SlipMemory& slip = memory_.slips[i];
    const double cut_off = missed[slip.input];
    if (slip.input == 0 || !(cut_off > 0.0)) continue;
    // What a rate misses adds up; an input that is limited comes back.
    const double left = others_[i].left();
    const double unknown =
        slip.period_s > 0.0 ? left + slip.period_s * cut_off : std::max(left, cut_off);
    others_[i] = {
        .lowest = kInfinity, .highest = -kInfinity, .unknown = std::min(slip.travel, unknown)};
  }
  is_zero_ = memory_.is_empty();
  update_bound();
}

double MemoryError::Travel::left() const noexcept {
  const double seen = highest >= lowest ? highest - lowest : 0.0;
  return std::max(0.0, unknown - seen);
}

void MemoryError::lose() noexcept {
  std::ranges::fill(share_, 1.0);
  interrupt(1.0);
}

void MemoryError::advance(std::span<const double> inputs) noexcept {
  for (std::size_t k = 0; k < share_.size(); ++k) share_[k] *= decay_[k];
  lowest_ = std::min(lowest_, inputs[0]);
  highest_ = std::max(highest_, inputs[0]);
  for (std::size_t i = 0; i < others_.size(); ++i) {
    const SlipMemory& slip = memory_.slips[i];
    if (slip.input == 0) continue;
    Travel& travel = others_[i];
    const double u = inputs[slip.input];
    travel.position = slip.period_s > 0.0 ? travel.position + slip.period_s * u : u;
    travel.lowest = std::min(travel.lowest, travel.position);
    travel.highest = std::max(travel.highest, travel.position);
  }
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
  const double unknown = std::min(width_, unknown_travel_);
  for (std::size_t i = 0; i < others_.size(); ++i) {
    const SlipMemory& slip = memory_.slips[i];
    if (slip.input == 0) {
      bound_ += slip.gain * std::max(0.0, std::min(slip.travel, unknown) - covered);
    } else {
      bound_ += slip.gain * others_[i].left();
    }
  }
}

void MemoryError::list(GuardListing& listing) const {
  listing.memory = memory_;
  listing.decay = decay_;
  listing.warm_up_ticks = warm_up_ticks_;
  listing.negligible = negligible_;
}

}  // namespace torsio::detail
