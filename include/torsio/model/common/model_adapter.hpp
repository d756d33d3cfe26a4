#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/model/common/adaptation.hpp"
#include "torsio/model/common/model.hpp"

namespace torsio::detail {

/// Ticks in a time, at least one.
[[nodiscard]] std::size_t ticks_in(double time_s, double period_s) noexcept;

inline constexpr std::size_t kMovingBlocks = 100;

/// Sums over the last stretch of time, in blocks of a hundredth of it: sums of blocks do not drift, unlike
/// running sums. Nothing is allocated after construction.
/// @tparam Sums of a block, with `add(const Sums&)`
template <class Sums>
class MovingSums {
 public:
  explicit MovingSums(std::size_t block_ticks)
      : blocks_(kMovingBlocks), block_ticks_(block_ticks) {}

  void reset() noexcept {
    for (Sums& block : blocks_) block = {};
    current_ = {};
    ticks_ = filled_ = next_ = 0;
  }
  /// The sums of the present block.
  [[nodiscard]] Sums& current() noexcept { return current_; }
  /// One tick. @returns the block that ends with it; null within a block
  const Sums* end_tick() noexcept TORSIO_REALTIME {
    if (++ticks_ < block_ticks_) return nullptr;
    ticks_ = 0;
    Sums& ended = blocks_[next_];
    ended = current_;
    current_ = {};
    next_ = (next_ + 1) % kMovingBlocks;
    filled_ = std::min(filled_ + 1, kMovingBlocks);
    return &ended;
  }
  /// Whether as many blocks have ended since the reset as the stretch contains.
  [[nodiscard]] bool is_full() const noexcept { return filled_ == kMovingBlocks; }
  [[nodiscard]] Sums total() const noexcept TORSIO_REALTIME {
    Sums total{};
    for (const Sums& block : blocks_) total.add(block);
    return total;
  }

 private:
  std::vector<Sums> blocks_;
  std::size_t block_ticks_;
  Sums current_{};
  std::size_t ticks_ = 0;   ///< in the current block
  std::size_t filled_ = 0;  ///< blocks since the reset, up to all
  std::size_t next_ = 0;    ///< block to be replaced
};

/// Compares two mean square errors over the last stretch of time.
class MovingComparison {
 public:
  /// @param ticks length of the stretch, rounded up to a multiple of 100.
  explicit MovingComparison(std::size_t ticks);

  void reset() noexcept;

  /// One tick.
  /// @returns true at the end of a block if the stretch is full and the first sum is the larger.
  bool step(double first_square, double second_square) noexcept TORSIO_REALTIME;
  /// One tick in which nothing was measured. @returns as `step`
  bool pass() noexcept TORSIO_REALTIME;

  /// Root mean square of the first errors in the blocks that have ended, at the end of the last one with a
  /// measurement; 0 before that.
  [[nodiscard]] double first_rms() const noexcept { return first_rms_; }

 private:
  struct Sums {
    double first = 0.0;
    double second = 0.0;
    double count = 0.0;

    void add(const Sums& other) noexcept {
      first += other.first;
      second += other.second;
      count += other.count;
    }
  };

  MovingSums<Sums> sums_;
  double first_rms_ = 0.0;
};

}  // namespace torsio::detail

namespace torsio {

class AnyModel;
class AnyParameters;

/// Adapts some parameters of a model to a reference, sample by sample: what the adapters of all
/// families have in common. A family adds its parameters and how they follow an error (`update`).
///
/// Guards: no update in the dead zone, beyond the largest error, or by a reference that is stale,
/// frozen, saturated or no number; back to the frozen parameters when the RMSE over the last
/// `comparison_s` exceeds that of the frozen model on the same samples. Samples whose reference is
/// beyond the largest error of both do not count there.
///
/// Source: specification 3.4. Nothing is allocated after construction.
class ModelAdapter {
 public:
  virtual ~ModelAdapter() = default;
  [[nodiscard]] virtual std::unique_ptr<ModelAdapter> copy() const = 0;

  /// No setting is automatic here: neither `rule` nor, as NaN, another one.
  [[nodiscard]] const AdaptationSettings& settings() const noexcept { return settings_; }

  /// Returns to the frozen parameters, all at once, and resets the counters.
  void reset() noexcept TORSIO_REALTIME;

  /// While paused, references are ignored; the adapted parameters stay in use.
  void pause() noexcept { paused_ = true; }
  void resume() noexcept { paused_ = false; }
  [[nodiscard]] bool is_paused() const noexcept { return paused_; }

  /// @param model the frozen one after its step. @param frozen what that returned.
  /// @returns the estimate with the adapted parameters, or `frozen` if something is not finite.
  virtual Estimate step(const AnyModel& model, Features features,
                        const Estimate& frozen) noexcept TORSIO_REALTIME = 0;

  /// Trains on the reference of the last step. Call it in every tick, with NaN where there is no
  /// reference.
  /// @param opinion of a `ReferenceCheck`, by which a reference is passed over that has no other fault.
  UpdateOutcome learn(const ReferenceSample& reference,
                      UpdateOutcome opinion = UpdateOutcome::updated) noexcept TORSIO_REALTIME;
  /// Counts a tick whose estimate was not the model's: `warming_up` or `no_estimate`.
  UpdateOutcome pass_over(UpdateOutcome reason) noexcept TORSIO_REALTIME;

  [[nodiscard]] const AdaptationCounts& counts() const noexcept { return counts_; }
  /// Whether the reference of the last step has no fault by itself.
  [[nodiscard]] bool accepts(const ReferenceSample& reference) const noexcept TORSIO_REALTIME {
    return !paused_ && reference.value != last_reference_ &&
           doubt_about(reference) == UpdateOutcome::updated;
  }
  /// The spread of the target in training, its unit.
  [[nodiscard]] double target_scale() const noexcept { return target_scale_; }
  /// The value of the frozen model in the last step.
  [[nodiscard]] double frozen_value() const noexcept { return frozen_value_; }
  /// RMSE before each update over the last `comparison_s` with references, of the parameters in use; 0
  /// before the first.
  [[nodiscard]] double recent_rmse() const noexcept { return comparison_.first_rms(); }
  /// How far the parameters are from the frozen ones; 0 without updates. What it is relative to is
  /// stated by the adapter.
  [[nodiscard]] virtual double relative_change() const noexcept = 0;
  /// @param base the frozen parameters. @returns those with what was learned: an ordinary model.
  [[nodiscard]] virtual AnyParameters adapted(AnyParameters base) const = 0;

 protected:
  /// Settings of a family in place of those that are automatic.
  struct Defaults {
    AdaptationRule rule = AdaptationRule::nlms;
    double initial_covariance = 1e-3;
  };
  /// @param target_scale the spread of the target in training, its unit.
  /// @throws Error if a setting is out of range.
  ModelAdapter(const AdaptationSettings& settings, const Defaults& defaults, double target_scale,
               double sample_period_s);
  ModelAdapter(const ModelAdapter&) = default;
  ModelAdapter& operator=(const ModelAdapter&) = default;

  /// The values of a step; without one, nothing is learned from the reference.
  void begin_step() noexcept { has_step_ = false; }
  void end_step(double frozen_value, double adapted_value) noexcept;
  void count_covariance_reset() noexcept { ++counts_.covariance_resets; }

 private:
  /// One update. @param error reference - adapted value, in spreads of the target.
  [[nodiscard]] virtual UpdateOutcome update(double error) noexcept = 0;
  /// Returns to the frozen parameters; with many of them in the next steps, a bounded number in each.
  virtual void restore() noexcept = 0;
  /// Ends what `restore` has begun.
  virtual void restore_at_once() noexcept {}

  [[nodiscard]] UpdateOutcome outcome_of(const ReferenceSample& reference,
                                         UpdateOutcome opinion) noexcept;
  /// Why a reference must not be used; `updated` if it may be.
  [[nodiscard]] UpdateOutcome doubt_about(const ReferenceSample& reference) const noexcept;
  void compare(double adapted_error, double frozen_error) noexcept;
  void compare_nothing() noexcept;
  void discard_what_was_learned() noexcept;
  void roll_back() noexcept;
  UpdateOutcome counted(UpdateOutcome outcome) noexcept;

  AdaptationSettings settings_;
  double target_scale_;
  std::size_t frozen_after_ticks_;
  double frozen_value_ = 0.0;   ///< at the last step
  double adapted_value_ = 0.0;  ///< at the last step
  bool has_step_ = false;
  double last_reference_ = kNotMeasured;
  std::size_t unchanged_ticks_ = 0;
  detail::MovingComparison comparison_;
  AdaptationCounts counts_;
  bool paused_ = false;
};

namespace detail {

/// @throws UsageError naming the rules that a family has, if `rule` is none of them.
void require_rule(AdaptationRule rule, bool is_supported, const std::string& family,
                  const std::string& supported);

}  // namespace detail

}  // namespace torsio
