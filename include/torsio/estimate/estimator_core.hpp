#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/fault.hpp"
#include "torsio/core/realtime.hpp"
#include "torsio/core/state_bytes.hpp"
#include "torsio/estimate/estimator_settings.hpp"
#include "torsio/model/common/family_traits.hpp"
#include "torsio/model/common/memory.hpp"
#include "torsio/model/common/model.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
struct GuardListing;
}

namespace torsio::detail {

/// Bounds the error of a model's output that is caused by inputs that its memory did not receive,
/// because they were missing or outside their range. The model is not stepped with such inputs. The
/// first input is assumed to have remained within its range of width W meanwhile, and to have moved
/// away from its values before and after by no more than the share s of W.
///
///     relaxation: e = g u,  u <- 1 - (1 - u) exp(-t / T) during t without inputs, u <- u exp(-t / T) with
///     slip:       e = g max(0, min(travel, W, U) - c),  U = s W, c the range covered since then
///
/// A relaxation follows an input that does not move, too, so that its error does not depend on s. How far
/// other inputs moved meanwhile is not known: U = W = travel for slips over them or their integrals, c the
/// range that these have covered since. Where inputs were only limited or may have been wrong, the
/// share of their range by which they were replaces 1 and s.
///
/// A memory that is not declared has no bound until the warm-up time has passed after the reset.
class MemoryError {
 public:
  /// @param memory of the model
  /// @param width W of the first input
  /// @param warm_up_s of a memory that is not declared; NaN: only `reset()` ends its recovery
  MemoryError(ModelMemory memory, double width, double sample_period_s, double warm_up_s);

  [[nodiscard]] const ModelMemory& memory() const noexcept { return memory_; }
  /// Whether the memory has received all inputs, as far as its output shows.
  [[nodiscard]] bool is_zero() const noexcept { return is_zero_; }
  /// The bound [target's unit]; infinity where there is none.
  [[nodiscard]] double bound() const noexcept { return bound_; }
  /// Whether the error may be larger than this error bar; NaN, an unknown one, counts as 0.
  [[nodiscard]] bool may_exceed(double error_bar) const noexcept {
    return !is_zero_ && !(bound_ <= error_bar);
  }

  void reset() noexcept;
  /// So many ticks passed without usable inputs. Successive calls without a usable tick between them
  /// are one interruption. @param share s of the whole interruption, 0 to 1
  /// @param others whether the model was not stepped; false: it was, with a limited first input
  void interrupt(double ticks, double share = 1.0, bool others = true) noexcept TORSIO_REALTIME;
  /// In so many ticks the memory received a first input that may have been wrong by this share of W, which
  /// may be above 1. Infinity: in all ticks.
  void doubt(double ticks, double share) noexcept TORSIO_REALTIME;
  /// At this tick the memory received other values of the inputs than the first: they were limited.
  /// @param missed |input - limited input|, one per input; the first is not looked at
  /// @param widths of the inputs' ranges
  void miss_others(std::span<const double> missed,
                   std::span<const double> widths) noexcept TORSIO_REALTIME;
  /// The memory itself is lost: the model was reset because its output was not finite.
  void lose() noexcept TORSIO_REALTIME;
  /// One tick with usable inputs.
  void follow(std::span<const double> inputs) noexcept TORSIO_REALTIME {
    if (!is_zero_) advance(inputs);
  }

  /// Fills its own part.
  void list(GuardListing& listing) const;

  /// The members that change in a step.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(share_, unknown_travel_, travel_before_, lowest_, highest_, others_, ticks_left_,
                bound_, is_zero_);
  }

 private:
  /// The travel of another input, or of its integral, since it was missed.
  struct Travel {
    [[nodiscard]] double left() const noexcept;
    void visit_state(StateBytes& bytes) noexcept {
      bytes.visit(position, lowest, highest, unknown);
    }

    double position = 0.0;
    double lowest = 0.0;
    double highest = 0.0;
    double unknown = 0.0;  ///< U
  };

  void advance(std::span<const double> inputs) noexcept;
  /// The error of a relaxation approaches this share for so many ticks; it does not decrease.
  void raise_share(std::size_t relaxation, double towards, double ticks) noexcept;
  /// The travel that is unknown grows by this share of W, in all other inputs to the largest one.
  void lose_travel(double share, bool others) noexcept;
  void update_bound() noexcept;

  ModelMemory memory_;
  double width_;
  double warm_up_ticks_;         ///< NaN: without end
  std::vector<double> decay_;    ///< exp(-h / T)
  std::vector<double> share_;    ///< u
  double unknown_travel_ = 0.0;  ///< U
  double travel_before_ = 0.0;   ///< U less c at the beginning of this interruption
  double lowest_ = 0.0;          ///< the first input since the last interruption
  double highest_ = 0.0;
  std::vector<Travel> others_;  ///< one for each slip; those of the first input are not used
  double ticks_left_ = 0.0;     ///< to the end of the warm-up
  double negligible_;           ///< a bound below this is 0
  double bound_ = 0.0;
  bool is_zero_ = true;
};

/// For how many ticks an input has been moving in one direction, from one turning point to the next. All members
/// are 0 after a reset.
class StrokeClock {
 public:
  /// @param dead_band turning back by at most this is part of the stroke
  explicit StrokeClock(double dead_band) : dead_band_(dead_band) {}

  void reset() noexcept { *this = StrokeClock(dead_band_); }
  void follow(double x) noexcept TORSIO_REALTIME {
    if (ticks_ == 0.0) extreme_ = x;
    ticks_ += 1.0;
    since_extreme_ += 1.0;
    const double moved = x - extreme_;
    if (direction_ == 0.0) {
      if (!(std::abs(moved) > dead_band_)) return;
      direction_ = moved > 0.0 ? 1.0 : -1.0;
    } else if (moved * direction_ < 0.0) {
      if (!(std::abs(moved) > dead_band_)) return;
      previous_ = ticks_ - since_extreme_;
      ticks_ = since_extreme_;
      direction_ = -direction_;
    }
    extreme_ = x;
    since_extreme_ = 0.0;
  }
  /// How long the present stroke has lasted, from its turning point.
  [[nodiscard]] double ticks() const noexcept { return ticks_; }
  /// The longer one of the present stroke and the one before it.
  [[nodiscard]] double longest() const noexcept { return std::max(ticks_, previous_); }

  /// The members that change in a step.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(ticks_, previous_, since_extreme_, extreme_, direction_);
  }

 private:
  double dead_band_;
  double ticks_ = 0.0;
  double previous_ = 0.0;       ///< ticks of the stroke before
  double since_extreme_ = 0.0;  ///< ticks
  double extreme_ = 0.0;        ///< the furthest value in the direction of this stroke
  double direction_ = 0.0;      ///< 1, -1; 0: not known yet
};

/// After a gap in the inputs that is longer than this, filters and model are reset. In a shorter one, what
/// depends on time receives interpolated inputs. As long a new level after a jump has to last until it is
/// used.
inline constexpr double kLongestGapSeconds = 0.01;

/// A raw input that changes in one tick by more than this multiple of its largest change in training
/// has jumped.
inline constexpr double kJumpFactor = 2.0;

/// The part of an estimator that does not depend on the family of its model: from raw channels to
/// features, and the guards that decide whether the model's output may be used.
class EstimatorCore {
 public:
  /// @throws Error if the settings contradict each other or the model, or a number in them is not
  /// finite.
  template <Model M>
  EstimatorCore(EstimatorSettings settings, const M& model)
      : EstimatorCore(std::move(settings), model.input_count(), traits_of_model(model),
                      [&model](const InputRanges& ranges) { return memory_of(model, ranges); }) {}

  /// What is made of the model's value for features that have left their ranges.
  enum class Verdict : std::uint8_t {
    use_model,
    blend,      ///< with the fallback, whose weight is `Excursion::fallback`
    fall_back,  ///< the fallback alone
  };

  /// How far features have left their ranges: 0 inside. The rule of docs/decisions/0027-beyond-the-range.md,
  /// for estimators and for `ModelInverse`.
  struct Excursion {
    double borders = 0.0;  ///< the worst feature's, in widths of its border; above 1 it is reported
    /// As a share of the width of its range, the worst feature's for which the model remains in use.
    double share = 0.0;
    double first = 0.0;     ///< the first feature's, likewise
    double rate = 0.0;      ///< the worst other one's, likewise, but in widths of its border
    double fallback = 0.0;  ///< weight of the fallback; above 1 it replaces the model
    [[nodiscard]] Verdict verdict() const noexcept {
      if (!(fallback > 0.0)) return Verdict::use_model;
      return fallback <= 1.0 ? Verdict::blend : Verdict::fall_back;
    }
    /// Whether it is reported as `outside_training_range`, also where the model remains in use.
    [[nodiscard]] bool is_outside() const noexcept { return borders > 1.0 || fallback > 1.0; }
  };

  /// One tick's raw channels after the pipeline.
  struct Conditioned {
    Features features;  ///< empty where `fault` is not none
    /// none, input_count_wrong, input_not_finite, or at the beginning of a jump outside_training_range
    Fault fault = Fault::none;
    bool restarted = false;  ///< the model is to be reset before it is stepped
    /// What the model is to be stepped with: the features, limited to their ranges and borders. Empty:
    /// the model is not to be stepped.
    Features for_model;
    Excursion excursion = {};  ///< its fallback is infinite in a tick that must not be used
  };

  [[nodiscard]] const EstimatorSettings& settings() const noexcept { return settings_; }
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept {
    return pipeline_.raw_inputs();
  }
  /// Whether the filters have settled, and what is unknown of a hysteresis at the start has a bound.
  [[nodiscard]] bool is_settled() const noexcept {
    return pipeline_.are_filters_settled() && std::isfinite(start_std_dev_);
  }
  /// The standard deviation that the unknown states of `stop` and `dahl` at the start cause: sum of
  /// |slope| e / sqrt(3), with the slopes of the fallback and the bounds e of the features, all values of
  /// which are taken as equally likely. 0 once they have decayed. Contained in the error bar.
  [[nodiscard]] double start_std_dev() const noexcept { return start_std_dev_; }

  /// In mid-run as a jump: what the memory received had another zero. @returns whether it has changed
  bool set_zero(std::string_view channel, double value);
  /// The zero of an input has changed.
  void follow_zero() noexcept;
  [[nodiscard]] const std::vector<std::string>& unset_zeros() const noexcept {
    return unset_zeros_;
  }
  void reset() noexcept;

  /// So many ticks did not take place.
  void miss(double ticks) noexcept TORSIO_REALTIME {
    missed_ = static_cast<std::size_t>(
        std::min(static_cast<double>(missed_) + std::max(ticks, 0.0), kMaxMissed));
  }
  /// How many interpolated ticks, `between`, what depends on time has to receive before these inputs. A
  /// jump there and back is a gap, too. 0: none were missed, or too many.
  std::size_t begin_interpolation(std::span<const double> raw) noexcept TORSIO_REALTIME {
    return missed_ == 0 || !can_interpolate(raw) ? 0 : std::exchange(missed_, 0);
  }
  /// @param left number of ticks between this one and `raw`, this one included
  std::span<const double> between(std::span<const double> raw,
                                  std::size_t left) noexcept TORSIO_REALTIME;

  Conditioned condition(std::span<const double> raw) noexcept TORSIO_REALTIME;
  /// The last value from good inputs, with the reason why it is held.
  [[nodiscard]] Estimate held(Fault fault) const noexcept TORSIO_REALTIME;
  [[nodiscard]] Excursion excursion(Features features) const noexcept TORSIO_REALTIME;
  /// The first reason why the fallback replaces `raw_estimate`, a model's output with this error bar in
  /// the unit of the target; none where the model is in use.
  [[nodiscard]] Fault replaced_for(const Excursion& excursion, const Estimate& raw_estimate,
                                   double std_dev) const noexcept TORSIO_REALTIME {
    if (is_wrong_rate_) return Fault::wrong_rate;
    if (excursion.verdict() == Verdict::fall_back) return Fault::outside_training_range;
    if (!is_settled()) return Fault::warming_up;
    if (raw_estimate.fault != Fault::none) return raw_estimate.fault;
    if (!std::isfinite(raw_estimate.value)) return Fault::model_not_finite;
    return memory_error_.may_exceed(std_dev) ? Fault::recovering : Fault::none;
  }
  /// The error bar of a value in use, which differs by so much from that of the fallback.
  [[nodiscard]] static double widened(double std_dev, const Excursion& excursion,
                                      double departure) noexcept TORSIO_REALTIME;
  /// The error bar of the residuals in the region of `value`; NaN: none.
  [[nodiscard]] double residual_std_at(double value) noexcept TORSIO_REALTIME;
  /// A raw input has jumped, and no tick since then has been inside the ranges: the last conditioned one
  /// must not be used.
  [[nodiscard]] bool is_in_jump() const noexcept { return in_jump_; }
  /// Applies the guards to `raw_estimate`, the model's output for these features; where they are not
  /// for the model, any.
  Estimate apply_guards(const Conditioned& input,
                        const Estimate& raw_estimate) noexcept TORSIO_REALTIME;
  /// The model was reset because its output was not finite.
  void lose_memory() noexcept TORSIO_REALTIME { memory_error_.lose(); }
  [[nodiscard]] bool model_has_memory() const noexcept { return has_memory_; }
  /// The ticks do not come at the sample rate, until this is called with false.
  void set_wrong_rate(bool is_wrong) noexcept TORSIO_REALTIME {
    is_wrong_rate_ = is_wrong && depends_on_rate_;
  }

  /// Whether an ordinary tick (finite inputs without a jump, all features inside their ranges) would change
  /// the filters, the last raw inputs, the last value and the clock of the strokes only.
  [[nodiscard]] bool is_at_rest() const noexcept TORSIO_REALTIME {
    return missed_ == 0 && !poisoned_ && !is_wrong_rate_ && !needs_reset_ && has_run_ &&
           !in_jump_ && excursion_ticks_ == 0.0 && level_error_ == 0.0 && is_settled() &&
           start_std_dev_ == 0.0 && memory_error_.is_zero();
  }
  /// What such a tick changes besides the filters.
  [[nodiscard]] std::span<const double> previous_raw() const noexcept { return previous_raw_; }
  [[nodiscard]] double previous_first() const noexcept { return previous_first_; }
  [[nodiscard]] double last_value() const noexcept { return last_value_; }
  [[nodiscard]] const StrokeClock& strokes() const noexcept { return strokes_; }
  void continue_after(const double* raw, double first, double value,
                      const StrokeClock& strokes) noexcept TORSIO_REALTIME {
    for (double& previous : previous_raw_) previous = *raw++;
    previous_first_ = first;
    last_value_ = value;
    strokes_ = strokes;
  }
  /// For the next `apply_guards`: one core serves many joints.
  void set_strokes(const StrokeClock& strokes) noexcept TORSIO_REALTIME { strokes_ = strokes; }
  /// Whether the error bar depends on the duration of strokes.
  [[nodiscard]] bool has_strokes() const noexcept { return longest_stroke_ > 0.0; }
  /// The largest change of a raw input in a tick that is not a jump.
  [[nodiscard]] double jump_limit(std::size_t channel) const noexcept {
    return jump_limits_[channel];
  }
  /// The range of a feature, rounding included.
  [[nodiscard]] double lowest(std::size_t feature) const noexcept {
    return ranges_[feature].lowest;
  }
  [[nodiscard]] double highest(std::size_t feature) const noexcept {
    return ranges_[feature].highest;
  }

  /// For what writes the guards down in another language.
  [[nodiscard]] GuardListing listing() const;

  /// The members that change in a step; not the zeros.
  void visit_state(StateBytes& bytes) noexcept {
    bytes.visit(pipeline_, missed_, poisoned_, last_value_, is_wrong_rate_, needs_reset_, has_run_,
                in_jump_, has_returned_, zero_changed_, excursion_ticks_, excursion_share_,
                previous_first_, previous_raw_, level_, start_std_dev_, memory_error_);
    bytes.visit(level_ticks_, jump_, offsets_, level_error_, strokes_);
  }
  /// Differs for the states of estimators with different settings.
  [[nodiscard]] std::uint64_t state_identity() const noexcept { return state_identity_; }

 private:
  static constexpr double kMaxMissed = 1e9;

  struct Range {
    double lowest = 0.0;
    double highest = 0.0;
    double border = 0.0;     ///< width, on either side, of the transition to the fallback
    double per_width = 0.0;  ///< 1 / the width of the range; 0 for a constant feature
    double reach = 0.0;      ///< beyond the range, where the transition to the fallback begins
    double held = 0.0;  ///< beyond the range, the value at which a model with memory receives it
  };

  EstimatorCore(EstimatorSettings settings, std::size_t model_input_count,
                const FamilyTraits& traits,
                const std::function<ModelMemory(const InputRanges&)>& memory);

  /// The error bar of the model's output: its own, or that of its region.
  [[nodiscard]] double model_std_dev(const Estimate& raw_estimate) noexcept;
  /// Blends the model's value with the fallback, whose share is `weight` in 0..1.
  [[nodiscard]] Estimate blended(Features features, double value, double std_dev,
                                 double weight) const noexcept;
  [[nodiscard]] double fallback_value(Features features) const noexcept;
  [[nodiscard]] double start_std_dev_now() const noexcept;
  /// n of `StrokeGuard`; 0 in strokes that are no longer than those of the training.
  [[nodiscard]] double stroke_novelty() const noexcept;
  /// The inputs of so many ticks could not be used.
  void interrupt(double ticks) noexcept;
  /// Whether a raw input differs from this one by more than it may change in so many ticks.
  [[nodiscard]] bool differs(std::span<const double> raw, std::span<const double> from,
                             std::size_t ticks) const noexcept;
  [[nodiscard]] bool can_interpolate(std::span<const double> raw) const noexcept;
  /// Whether a raw input has jumped, and its new level has not lasted yet.
  bool is_new_level(std::span<const double> raw) noexcept;
  /// The first usable tick after missed ones.
  void resume(double first) noexcept;
  /// Torque per raw input at rest, by the fallback. 0 where it is not known.
  [[nodiscard]] std::vector<double> slopes_at_rest() const;
  /// One of the two levels of a jump is wrong: from now on the error bar contains the torque between them.
  void keep_offsets() noexcept;
  /// What the model receives in a tick after a jump, and in one of a continuous excursion.
  void exclude(Conditioned& input) noexcept;
  void limit(Conditioned& input) noexcept;
  /// What it received in an excursion may have been wrong.
  void count_excursion(double first) noexcept;
  void end_excursion() noexcept;

  EstimatorSettings settings_;
  FeaturePipeline pipeline_;
  [[nodiscard]] Range range_of(std::size_t feature, const FamilyTraits& traits) const;

  std::vector<Range> ranges_;   ///< per feature, tolerance included
  double first_width_ = 0.0;    ///< width of the range of the first feature
  bool assumes_jumps_ = false;  ///< the largest steps of the training are not known
  std::vector<std::string> unset_zeros_;
  std::size_t longest_gap_;  ///< ticks
  std::size_t missed_ = 0;   ///< ticks in a row without usable input
  bool poisoned_ = false;    ///< filters, differences and lags contain a value that is not usable
  double last_value_ = 0.0;
  bool has_memory_ = false;
  bool resets_model_ = false;  ///< a memory that is not declared starts again after an interruption
  bool depends_on_rate_ = false;
  bool is_wrong_rate_ = false;
  bool needs_reset_ = false;              ///< the model is to be reset in its next step
  bool has_run_ = false;                  ///< the model has been stepped since `reset()`
  bool in_jump_ = false;                  ///< since a jump, no tick has been inside the ranges
  std::size_t level_ticks_ = 0;           ///< since the last jump; 0: its level is in use
  bool has_returned_ = false;             ///< the last jump returned to what a motion explains
  bool zero_changed_ = false;             ///< since the last tick
  double excursion_ticks_ = 0.0;          ///< beyond a width of the range; counted down inside it
  double excursion_share_ = 0.0;          ///< error of the first input in them, if it was wrong
  double previous_first_ = kNotMeasured;  ///< first feature of the last usable tick
  std::vector<double> previous_raw_;      ///< raw inputs of the last usable tick; NaN: none
  std::vector<double> level_;             ///< raw inputs of the last tick after a jump
  std::vector<double> between_;           ///< interpolated raw inputs
  std::vector<double> jump_;              ///< change of the raw inputs in the last jump
  std::vector<double> offsets_;           ///< sum of the jumps whose levels came into use
  std::vector<double> raw_slopes_;        ///< torque per raw input
  double largest_output_ = std::numeric_limits<double>::infinity();
  double level_error_ = 0.0;          ///< the torque of `offsets_`
  std::vector<double> jump_limits_;   ///< the largest change of a raw input in a tick
  std::vector<double> limited_;       ///< features
  std::vector<double> missed_parts_;  ///< by which the features were limited
  std::vector<double> widths_;        ///< widths of the ranges of the features
  double start_std_dev_ = 0.0;
  std::size_t residual_region_ = 0;  ///< the region to look at first
  StrokeClock strokes_{0.0};
  double longest_stroke_ = 0.0;  ///< the longest in training [ticks]; 0: strokes are not followed
  std::uint64_t state_identity_ = 0;
  MemoryError memory_error_{{}, 0.0, 1.0, 0.0};
};

}  // namespace torsio::detail
