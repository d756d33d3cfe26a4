#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/realtime.hpp"

namespace torsio::detail {

/// In how many of the last samples a condition was true. Nothing is allocated after construction.
class RecentCount {
 public:
  RecentCount() = default;
  /// @param samples at least 1
  explicit RecentCount(std::size_t samples) : was_true_(samples, 0) {}

  void reset() noexcept {
    for (std::uint8_t& each : was_true_) each = 0;
    next_ = count_ = 0;
  }
  /// @returns the count, this sample included
  std::size_t add(bool is_true) noexcept TORSIO_REALTIME {
    std::uint8_t& oldest = was_true_[next_];
    count_ = count_ + (is_true ? 1 : 0) - oldest;
    oldest = is_true ? 1 : 0;
    next_ = next_ + 1 == was_true_.size() ? 0 : next_ + 1;
    return count_;
  }

 private:
  std::vector<std::uint8_t> was_true_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace torsio::detail

namespace torsio {

/// What a monitor checks. docs/robot/safety.md has the fault that each one detects.
enum class MonitorCheck : std::uint8_t {
  disagreement,     ///< two valid sources differ by more than the threshold of their pair
  drift,            ///< they differ by a little for a long time (cumulative sum)
  sign,             ///< they have opposite signs, each beyond half the threshold of their pair
  source_lost,      ///< an input of a source is missing, stale or not a number
  source_fault,     ///< a source has inputs outside its range, or its model failed
  redundancy_lost,  ///< fewer than two sources of several have inputs and have settled
  novelty,          ///< the inputs of a source are unlike those of its training
  not_finite,       ///< a signal is NaN or infinite
  stale,            ///< a signal has not been measured for too long
  range,            ///< a signal is outside its range; a deflection, a temperature likewise
  rate,             ///< a signal changed faster than it can
  wrap,             ///< an angle changed by a turn of its encoder
  frozen,           ///< a signal does not change while one that is connected to it moves
  period,           ///< the loop is late, or its clock runs backwards
  requested,        ///< none of these: a stop from outside, or nothing was found
};
inline constexpr std::size_t kMonitorChecks = 14;  ///< without `requested`, which has no action

/// What happens when a check finds something.
enum class MonitorAction : std::uint8_t { off, warn, stop };

/// A measured quantity, as the drive delivers it.
struct MonitoredSignal {
  std::string name;
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  double largest_rate = std::numeric_limits<double>::infinity();  ///< in its unit per second
  double longest_age_s = std::numeric_limits<double>::infinity();
  double turn = 0.0;  ///< by which its encoder wraps around; 0: it does not
  /// A signal that cannot move without this one: "gear_angle_rad" of "motor_angle_rad". Empty:
  /// none.
  std::string moves_with = {};
  /// How far that one may move, in its unit, without a change of this one.
  double largest_hidden_travel = std::numeric_limits<double>::infinity();
};

/// Limits for the difference of two sources.
struct PairLimits {
  std::uint8_t first = 0;
  std::uint8_t second = 1;
  /// Threshold of |difference| as a multiple of the standard deviation of the difference that the
  /// error bars give, never below the floor nor above the ceiling.
  double factor = 6.0;
  double floor_Nm = 0.0;
  double ceiling_Nm = std::numeric_limits<double>::infinity();
  /// While the error bars would make the threshold larger than this without the ceiling, the
  /// monitor is not ready: the pair could miss the disagreement that it has to detect.
  double largest_armed_Nm = std::numeric_limits<double>::infinity();
  /// For the cumulative sum: the share of the threshold that is not counted, and the sum in seconds
  /// times threshold at which it reports.
  double drift_allowance = 0.75;
  double drift_limit_s = std::numeric_limits<double>::infinity();
};

struct MonitorSettings {
  std::vector<std::string> sources;
  std::vector<MonitoredSignal> signals;
  std::vector<PairLimits> pairs;
  /// Correlation of the sources' errors, row by row; empty: none.
  std::vector<double> correlation;
  std::array<MonitorAction, kMonitorChecks> actions = default_actions();
  /// How long a difference must exceed its threshold: in more samples than this time has, among the
  /// last three times as many, so that a difference that oscillates through zero is found as well.
  double persistence_s = 5e-3;
  double release_share = 0.8;  ///< below this share of the threshold, it has ended
  /// How long a lost source is only a warning, how long a source may report a fault of its model or
  /// range, and how long one may warm up (then it is a `source_fault`). Of each, four samples
  /// without it compensate for one with it, so that one that comes and goes is found as well.
  double longest_loss_s = 0.5;
  double longest_fault_s = 0.015;
  double longest_warm_up_s = 10.0;
  double largest_novelty = std::numeric_limits<double>::infinity();
  double sample_period_s = 1e-3;
  std::uint32_t longest_overrun = 3;  ///< so many late ticks in a row are a fault
  /// So many samples beyond range or rate are a fault: one is passed over. Those before count if
  /// the samples between were good for `spike_memory_s` at most.
  std::uint32_t spikes_in_a_row = 2;
  double spike_memory_s = 0.02;
  double proof_s = 0.05;  ///< how long every check must be silent before the joint may move
  double longest_command_age_s = 1.0;  ///< age of a command that arms

  /// stop, but warn for source_lost (which stops after `longest_loss_s`) and novelty.
  static std::array<MonitorAction, kMonitorChecks> default_actions() noexcept;
};

/// A finding of a monitor, in numbers.
struct MonitorEvent {
  double t_s = 0.0;
  MonitorCheck check = MonitorCheck::requested;
  MonitorAction action = MonitorAction::off;  ///< off: nothing was found
  std::uint8_t first = 0;                     ///< index of the source or signal
  std::uint8_t second = 0;                    ///< the other source of a pair, else equal to `first`
  double value = 0.0;                         ///< what was found, and its limit
  double limit = 0.0;
};

/// One signal at one tick.
struct SignalSample {
  double value = kNotMeasured;
  double age_s = 0.0;  ///< since its sensor measured it, by the clock of the loop
};

namespace detail {
/// Cumulative sums of the difference of a pair, in seconds times threshold.
struct DriftSums {
  double up_s = 0.0;
  double down_s = 0.0;
};
}  // namespace detail

/// Decides in every tick whether a joint may move with the torque that its sources estimate.
///
///     unproven  --every check silent and no source warming up for proof_s, and armed-->  watching
///     watching  --a check whose action is stop-->  stopped  --reset-->  unproven
///
/// A stop is latched: only `reset` ends it, and the joint may move again after the proof and `arm`
/// with a command that was written after the reset. Valid sources that disagree stop the joint,
/// without a vote. Only `is_watching()` permits torque; what a stop does is a matter of `JointStop`
/// and of the brake.
///
/// - disagreement: |t_i - t_j| > clamp(factor sqrt(s_i^2 + s_j^2 - 2 R_ij s_i s_j), floor, ceiling)
///   =: h for `persistence_s` within three times that time, with hysteresis: it ends below
///   `release_share` h.
/// - drift: S <- max(0, S + ((t_i - t_j) / h - drift_allowance) T) > drift_limit_s, on either side.
/// - sign: t_i and t_j have opposite signs and min(|t_i|, |t_j|) > h / 2, likewise.
/// - frozen: the signal keeps exactly one value while its companion travels further than
///   `largest_hidden_travel`; at rest there is no travel.
///
/// The monitor is not ready while a pair's h, without the ceiling, is above largest_armed, as long
/// as the friction of a drive is unknown, nor while a source warms up, for nothing is compared with it.
///
/// Every comparison is written so that NaN is a fault, but that of the novelty, which most models do
/// not have. Source: specification 3.9 for the residuals; Page 1954 for the cumulative sum; states
/// and checks are ours.
class Monitor {
 public:
  static constexpr std::size_t kMaxSources = 8;
  static constexpr std::size_t kMaxSignals = 16;
  static constexpr std::size_t kMaxPairs = kMaxSources * (kMaxSources - 1) / 2;
  static constexpr std::size_t kMaxFindings = 32;  ///< in one tick that are kept

  enum class State : std::uint8_t { unproven, ready, watching, stopped };

  /// @throws Error if a name, an index or a limit is not valid.
  explicit Monitor(MonitorSettings settings);

  /// The operator permits motion. Without effect unless the state is `ready` and the command was
  /// written after the last reset, at most `longest_command_age_s` before the last tick and a
  /// period after it.
  /// @returns whether it watches now
  bool arm(double command_written_s) noexcept TORSIO_REALTIME;
  /// Ends a stop. Nothing moves before the proof and `arm`; after a reset at a time that is not
  /// finite, not before another reset either. A time that is not between the ticks before and after
  /// the reset (another clock) is replaced by that of the tick after it.
  void reset(double t_s) noexcept TORSIO_REALTIME;
  /// A stop from outside.
  void stop(double t_s) noexcept TORSIO_REALTIME;

  /// Call in every tick. @param sources, signals in the order of the settings; another count is
  /// `not_finite`, and a stop whatever the action of that check.
  State step(double t_s, std::span<const Estimate> sources,
             std::span<const SignalSample> signals) noexcept TORSIO_REALTIME;

  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] bool is_watching() const noexcept { return state_ == State::watching; }
  /// Checks that found something in the last tick: bit (int)check.
  [[nodiscard]] std::uint32_t active() const noexcept { return active_; }
  /// What was found in the last tick, the first ones if there are more than `kMaxFindings`.
  [[nodiscard]] std::span<const MonitorEvent> findings() const noexcept {
    return std::span(findings_).first(findings_count_);
  }
  /// In the last tick the error bars made the threshold of a pair larger than its
  /// `largest_armed_Nm`.
  [[nodiscard]] bool is_threshold_too_large() const noexcept { return is_threshold_too_large_; }
  /// The first finding of the last stop; of a stop from outside the check is `requested`.
  [[nodiscard]] const MonitorEvent& reason() const noexcept { return reason_; }
  /// The most recent finding of any check, warnings included.
  [[nodiscard]] const MonitorEvent& latest() const noexcept { return latest_; }
  /// Pairs of sources that differ too much at present.
  [[nodiscard]] std::span<const std::array<std::uint8_t, 2>> disagreeing() const noexcept {
    return std::span(disagreeing_).first(disagreeing_count_);
  }
  [[nodiscard]] const MonitorSettings& settings() const noexcept { return settings_; }

 private:
  struct SignalState {
    double last = 0.0;  ///< last sample that was not passed over
    double last_t_s = 0.0;
    double companion = kNotMeasured;  ///< angle of the companion when this signal changed last
    std::uint32_t beyond = 0;         ///< recent samples beyond range or rate
    std::uint32_t within = 0;         ///< samples since then
    bool has_last = false;
  };
  struct SourceState {
    // Quarters of samples, less one for each sample without it.
    std::uint32_t lost = 0;
    std::uint32_t faulty = 0;
    std::uint32_t warming_up = 0;
    std::uint32_t novel = 0;  ///< samples in a row
  };
  struct PairState {
    detail::RecentCount beyond;
    detail::RecentCount opposite;
    detail::DriftSums drift;
    bool disagrees = false;
  };

  void clear() noexcept;
  void find(const MonitorEvent& found) noexcept TORSIO_REALTIME;
  void check_period(double t_s) noexcept TORSIO_REALTIME;
  void check_signal(std::size_t i, std::span<const SignalSample> signals) noexcept TORSIO_REALTIME;
  void check_change(std::size_t i, const SignalSample& sample) noexcept TORSIO_REALTIME;
  void check_frozen(std::size_t i) noexcept TORSIO_REALTIME;
  void check_source(std::size_t i, const Estimate& estimate) noexcept TORSIO_REALTIME;
  void check_novelty(std::size_t i, const Estimate& estimate) noexcept TORSIO_REALTIME;
  /// Counts one sample. @returns whether the condition has lasted for too long
  [[nodiscard]] bool count(std::uint32_t& quarters, bool is_present,
                           double longest_s) const noexcept TORSIO_REALTIME;
  void check_pair(std::size_t i, std::span<const Estimate> sources) noexcept TORSIO_REALTIME;
  void decide(double t_s) noexcept TORSIO_REALTIME;

  MonitorSettings settings_;
  std::array<std::uint8_t, kMaxSignals> companion_{};  ///< one for each signal; its own index: none
  std::array<SignalState, kMaxSignals> signal_states_{};
  std::array<SourceState, kMaxSources> source_states_{};
  std::array<PairState, kMaxPairs> pair_states_{};
  std::array<std::array<double, kMaxSources>, kMaxSources> correlation_{};
  std::array<std::array<std::uint8_t, 2>, kMaxPairs> disagreeing_{};
  std::size_t disagreeing_count_ = 0;
  std::array<MonitorEvent, kMaxFindings> findings_{};
  std::size_t findings_count_ = 0;
  State state_ = State::unproven;
  MonitorEvent reason_;
  MonitorEvent latest_;
  std::uint32_t active_ = 0;
  MonitorEvent stop_found_;  ///< the first finding of this tick that stops; `action` off: none
  double last_t_s_ = kNotMeasured;
  double t_s_ = 0.0;
  std::uint32_t late_ = 0;
  double silent_since_s_ = kNotMeasured;
  bool is_threshold_too_large_ = false;
  bool is_warming_up_ = false;
  double reset_t_s_ = -std::numeric_limits<double>::infinity();
  double before_reset_s_ = -std::numeric_limits<double>::infinity();  ///< last tick before it
};

/// The enumerators' own spelling.
[[nodiscard]] std::string_view name(MonitorCheck check) noexcept;
[[nodiscard]] std::string_view name(MonitorAction action) noexcept;
[[nodiscard]] std::string_view name(Monitor::State state) noexcept;

/// A finding as a sentence, with the names of its source or signal, value and limit. Allocates.
[[nodiscard]] std::string describe(const MonitorEvent& event, const MonitorSettings& settings);

}  // namespace torsio
