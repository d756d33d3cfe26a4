// What the filters and the memory of a model receive where inputs were missed, have jumped or have left their ranges.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "core/all_finite.hpp"
#include "torsio/estimate/estimator_core.hpp"

namespace torsio::detail {
namespace {

/// A wrong sensor is wrong before it leaves the range and after it returns, too: about as long in all.
constexpr double kExcursionDoubt = 2.0;
constexpr double kLargestShare = 2.0;
/// Ticks of an excursion per tick of its return.
constexpr double kTicksPerReturn = 2.0;
/// Ticks inside the range per tick of the way back from a width beyond it.
constexpr double kReturnInside = 1.5;

}  // namespace

void EstimatorCore::interrupt(double ticks) noexcept {
  if (!has_run_) return;  // a model that has not run yet starts at rest
  // As far as the first input can have moved to and fro meanwhile. NaN: anywhere.
  const double travel = kJumpFactor * settings_.disturbances.largest_travel * ticks;
  memory_error_.interrupt(ticks, travel < first_width_ ? travel / first_width_ : 1.0);
  needs_reset_ = resets_model_;
}

bool EstimatorCore::differs(std::span<const double> raw, std::span<const double> from,
                            std::size_t ticks) const noexcept {
  const auto count = static_cast<double>(ticks);
  bool found = false;
  for (std::size_t i = 0; i < raw.size(); ++i)
    found |= std::abs(raw[i] - from[i]) > count * jump_limits_[i];
  return found;
}

bool EstimatorCore::can_interpolate(std::span<const double> raw) const noexcept {
  if (missed_ > longest_gap_ || poisoned_ || is_wrong_rate_ || !depends_on_rate_ || !has_run_)
    return false;
  if (raw.size() != previous_raw_.size() || !all_finite(raw)) return false;
  if (differs(raw, previous_raw_, missed_ + 1)) return false;
  // Only a second jump ends the first one.
  return level_ticks_ == 0 || differs(raw, level_, 1);
}

std::span<const double> EstimatorCore::between(std::span<const double> raw,
                                               std::size_t left) noexcept {
  level_ticks_ = 0;
  in_jump_ = false;
  const double share = 1.0 / static_cast<double>(left + 1);
  for (std::size_t i = 0; i < raw.size(); ++i)
    between_[i] = std::lerp(previous_raw_[i], raw[i], share);
  return between_;
}

bool EstimatorCore::is_new_level(std::span<const double> raw) noexcept {
  const bool is_explained = !differs(raw, previous_raw_, missed_ + 1);
  if (level_ticks_ == 0 && is_explained) return false;
  if (level_ticks_ == 0 || differs(raw, level_, 1)) {
    for (std::size_t i = 0; i < raw.size(); ++i)
      jump_[i] = level_ticks_ == 0 ? raw[i] - previous_raw_[i] : jump_[i] + (raw[i] - level_[i]);
    has_returned_ = is_explained;
    level_ticks_ = has_returned_ && missed_ <= longest_gap_ ? 0 : 1;
  } else {
    ++level_ticks_;
  }
  std::ranges::copy(raw, level_.begin());
  return level_ticks_ > 0 && level_ticks_ <= longest_gap_;
}

// A jump can be a sensor error: no memory receives it. A model without one is stepped all the same.
void EstimatorCore::exclude(Conditioned& input) noexcept {
  poisoned_ = true;
  ++missed_;
  if (has_memory_) input.for_model = {};
  input.excursion.fallback = std::numeric_limits<double>::infinity();
}

// Between two levels without a motion that explains them, one is wrong, and it may be the one that the memory
// has received.
void EstimatorCore::resume(double first) noexcept {
  interrupt(static_cast<double>(missed_));
  const bool is_other_level = level_ticks_ > 0 && !has_returned_;
  if (is_other_level && has_run_) keep_offsets();
  if (has_run_ && (zero_changed_ || is_other_level)) {
    const double moved = std::abs(first - previous_first_);
    memory_error_.doubt(std::numeric_limits<double>::infinity(),
                        moved < first_width_ ? moved / first_width_ : 1.0);
  }
  missed_ = 0;
  level_ticks_ = 0;
  zero_changed_ = false;
}

// A continuous excursion is a motion: the memory misses no more than what the first input travelled
// beyond its border.
void EstimatorCore::limit(Conditioned& input) noexcept {
  for (std::size_t i = 0; i < limited_.size(); ++i)
    limited_[i] = std::clamp(input.features[i], ranges_[i].lowest - ranges_[i].held,
                             ranges_[i].highest + ranges_[i].held);
  input.for_model = limited_;
  const double missed = std::abs(input.features[0] - limited_[0]);
  if (!has_run_) return;
  count_excursion(input.features[0]);
  memory_error_.interrupt(1.0, std::min(1.0, missed / first_width_), false);
  for (std::size_t i = 0; i < limited_.size(); ++i)
    missed_parts_[i] = std::abs(input.features[i] - limited_[i]);
  memory_error_.miss_others(missed_parts_, widths_);
}

// A motion that is larger than that of the training may leave its range, but hardly by more than a width: then it
// can be the sensor that is wrong, by up to the whole range and what is beyond it.
void EstimatorCore::count_excursion(double first) noexcept {
  const double beyond = std::max(ranges_.front().lowest - first, first - ranges_.front().highest);
  if (!(beyond > first_width_)) {
    // As fast as it comes back to the border, it may continue inside.
    if (excursion_share_ > 0.0) excursion_ticks_ += kTicksPerReturn * kReturnInside;
    return;
  }
  if (first_width_ > 0.0)
    excursion_share_ =
        std::max(excursion_share_, std::min(1.0 + beyond / first_width_, kLargestShare));
  excursion_ticks_ += 1.0;
}

// Called in every tick inside the ranges until half as many have passed: what has been covered meanwhile may be
// the return of the sensor and no motion.
void EstimatorCore::end_excursion() noexcept {
  memory_error_.doubt(kExcursionDoubt * excursion_ticks_, excursion_share_);
  excursion_ticks_ -= kTicksPerReturn;
  if (excursion_ticks_ > 0.0) return;
  excursion_ticks_ = 0.0;
  excursion_share_ = 0.0;
}

void EstimatorCore::follow_zero() noexcept {
  zero_changed_ = has_run_;
  poisoned_ = poisoned_ || has_run_;
  std::ranges::fill(offsets_, 0.0);
  level_error_ = 0.0;
}

std::vector<double> EstimatorCore::slopes_at_rest() const {
  FeaturePipeline pipeline(settings_.features, settings_.sample_rate_Hz);
  std::vector<double> raw(raw_inputs().size(), 0.0);
  const auto torque_at = [&] {
    pipeline.reset();
    const Features features = pipeline.step(raw);
    return std::inner_product(features.begin(), features.end(), settings_.fallback.slope.begin(),
                              0.0);
  };
  const double at_zero = torque_at();
  std::vector<double> slopes;
  for (double& each : raw) {
    constexpr double kSmall = 1e-6;
    each = kSmall;
    const double slope = (torque_at() - at_zero) / kSmall;
    slopes.push_back(std::isfinite(slope) ? slope : 0.0);
    each = 0.0;
  }
  return slopes;
}

void EstimatorCore::keep_offsets() noexcept {
  double torque = 0.0;
  for (std::size_t i = 0; i < offsets_.size(); ++i) {
    offsets_[i] += jump_[i];
    // The motion in the ticks of the jumps remains where the second one returns.
    if (!(std::abs(offsets_[i]) > jump_limits_[i])) offsets_[i] = 0.0;
    torque += raw_slopes_[i] * offsets_[i];
  }
  level_error_ = std::abs(torque);
}

}  // namespace torsio::detail
