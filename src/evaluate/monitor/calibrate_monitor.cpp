#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>

#include "core/report_progress.hpp"
#include "evaluate/monitor/exceedance.hpp"
#include "evaluate/monitor/source_run.hpp"
#include "numerics/quantile.hpp"
#include "safety/pair_difference.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {
namespace {

constexpr double kBlock_s = 10.0;
constexpr std::size_t kLeastBlocks = 10;
constexpr double kSecondsPerHour = 3600.0;
constexpr double kLargestGuardedShare = 0.01;
constexpr double kArmedShare = 0.8;    // threshold that is armed, over the required disagreement
constexpr double kRangeMargin = 0.25;  // margin on either side, over the range in the recordings
constexpr double kCeilingMargin = 1.25;
constexpr double kDriftWindow_s = 60.0;
/// The correlation is known only from a finite record: it is taken a little towards none.
constexpr double kCorrelationShare = 0.95;

std::size_t samples_of(double seconds, double rate_Hz) {
  return static_cast<std::size_t>(std::ceil(seconds * rate_Hz - 1e-9));
}

/// The errors in units of their error bars, where the torque was measured.
class ErrorMoments {
 public:
  explicit ErrorMoments(std::size_t sources) : sources_(sources), sums_(sources * sources) {}

  void add(const std::vector<SourceRun>& runs, std::span<const double> measured_Nm) {
    std::vector<double> errors(sources_);
    for (std::size_t n = 0; n < measured_Nm.size(); ++n) {
      bool is_usable = std::isfinite(measured_Nm[n]);
      for (std::size_t i = 0; i < sources_ && is_usable; ++i) {
        is_usable = runs[i].is_valid(n);
        errors[i] = (runs[i].value_Nm[n] - measured_Nm[n]) / runs[i].std_dev_Nm[n];
      }
      if (!is_usable) continue;
      for (std::size_t i = 0; i < sources_; ++i)
        for (std::size_t j = 0; j < sources_; ++j) sums_[i * sources_ + j] += errors[i] * errors[j];
      ++samples_;
    }
  }

  /// Root mean squares; 1 where the torque was not measured.
  [[nodiscard]] std::vector<double> sizes() const {
    std::vector<double> sizes(sources_, 1.0);
    for (std::size_t i = 0; i < sources_ && samples_ > 0; ++i)
      if (const double square = sums_[i * sources_ + i] / static_cast<double>(samples_);
          square > 0.0)
        sizes[i] = std::sqrt(square);
    return sizes;
  }

  /// Row by row; empty where the torque was not measured.
  [[nodiscard]] std::vector<double> correlation() const {
    if (samples_ == 0) return {};
    std::vector<double> rows(sums_.size(), 1.0);
    for (std::size_t i = 0; i < sources_; ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const double length = std::sqrt(sums_[i * sources_ + i] * sums_[j * sources_ + j]);
        const double correlation =
            length > 0.0 ? kCorrelationShare * sums_[i * sources_ + j] / length : 0.0;
        rows[i * sources_ + j] = rows[j * sources_ + i] = correlation;
      }
    return rows;
  }

 private:
  std::size_t sources_;
  std::size_t samples_ = 0;
  std::vector<double> sums_;
};

/// The differences of two sources in the recordings.
class PairStatistics {
 public:
  PairStatistics(PairLimits pair, double correlation, double rate_Hz, double persistence_s)
      : pair_(pair),
        correlation_(correlation),
        period_s_(1.0 / rate_Hz),
        window_(detail::persistent_samples(persistence_s, period_s_)),
        small_(samples_of(kBlock_s, rate_Hz)),
        large_(samples_of(kBlock_s, rate_Hz)) {}

  void see_spread(const std::vector<SourceRun>& runs) {
    constexpr std::size_t kEvery = 97;  // the median needs no more
    for (std::size_t n = 0; n < runs[0].value_Nm.size(); n += kEvery)
      if (is_valid(runs, n)) spreads_.push_back(spread(runs, n));
  }

  // A difference is found if |d| > floor and |d| > factor s in enough samples of a window. What persists is
  // therefore taken of each, and one of the two has to be prevented: which one is decided by s at
  // the end of the window.
  void see_differences(const std::vector<SourceRun>& runs) {
    if (std::isnan(median_Nm_)) median_Nm_ = quantile(spreads_, 0.5);
    const std::size_t samples = runs[0].value_Nm.size();
    std::vector<double> sizes(samples, kNotMeasured);
    std::vector<double> shares(samples, kNotMeasured);
    for (std::size_t n = 0; n < samples; ++n) {
      if (!is_valid(runs, n)) continue;
      sizes[n] = std::abs(difference(runs, n));
      shares[n] = sizes[n] > 0.0 ? sizes[n] / spread(runs, n) : 0.0;
      largest_Nm_ = std::max(largest_Nm_, sizes[n]);
      first_torque_Nm_ = std::max(first_torque_Nm_, std::abs(runs[pair_.first].value_Nm[n]));
      second_torque_Nm_ = std::max(second_torque_Nm_, std::abs(runs[pair_.second].value_Nm[n]));
    }
    sizes = persisting(sizes, window_);
    shares = persisting(shares, window_);
    for (std::size_t n = 0; n < samples; ++n)
      (is_valid(runs, n) && spread(runs, n) <= median_Nm_ ? shares : sizes)[n] = kNotMeasured;
    small_.add(sizes);
    large_.add(shares);
  }

  /// @param share of the blocks in which the pair may exceed its threshold
  /// @param least_Nm the smallest threshold
  /// @param required_Nm see `CalibrationOptions`
  void set_thresholds(double share, double least_Nm, double required_Nm) {
    const double small_Nm = small_.threshold(share);
    is_factor_from_floor_ = large_.size() < kLeastBlocks;
    pair_.floor_Nm = std::max(small_Nm, least_Nm);
    pair_.largest_armed_Nm = std::max(kArmedShare * required_Nm, 1.1 * pair_.floor_Nm);
    pair_.factor =
        std::max(is_factor_from_floor_ ? small_Nm / median_Nm_ : large_.threshold(share), 1.0);
  }

  /// The largest threshold while the pair is watched, which begins when it is narrow enough to be
  /// armed.
  void see_thresholds(const std::vector<SourceRun>& runs) {
    bool is_watched = false;
    for (std::size_t n = 0; n < runs[0].value_Nm.size(); ++n) {
      if (!is_valid(runs, n)) continue;
      const double threshold_Nm = detail::threshold_without_ceiling(pair_, spread(runs, n));
      is_watched = is_watched || threshold_Nm <= pair_.largest_armed_Nm;
      if (is_watched) largest_threshold_Nm_ = std::max(largest_threshold_Nm_, threshold_Nm);
    }
  }
  void set_ceiling(const std::vector<TorqueSource>& sources) {
    if (largest_threshold_Nm_ == 0.0)
      throw Error({.place = fmt::format("pair {}, {}", sources[pair_.first].name,
                                        sources[pair_.second].name),
                   .expected = fmt::format("recordings in which the error bars permit a threshold "
                                           "of at most {:.3g} Nm at least once",
                                           pair_.largest_armed_Nm),
                   .found = "none: the monitor would never be ready",
                   .advice = "require a larger disagreement, or record a motion after which the "
                             "friction is known"});
    pair_.ceiling_Nm = kCeilingMargin * largest_threshold_Nm_;
  }

  void see_drift(const std::vector<SourceRun>& runs) {
    const std::size_t window = samples_of(kDriftWindow_s, 1.0 / period_s_);
    double sum = 0.0;
    std::size_t seen = 0;
    each_share(runs, [&](double share, bool is_watched) {
      if (!is_watched) return;
      sum += share;
      if (++seen < window) return;
      largest_mean_ = std::max(largest_mean_, std::abs(sum) / static_cast<double>(seen));
      sum = 0.0;
      seen = 0;
    });
  }
  void set_allowance() { pair_.drift_allowance = std::clamp(1.2 * largest_mean_, 0.75, 0.95); }

  void see_sums(const std::vector<SourceRun>& runs) {
    detail::DriftSums sums;
    each_share(runs, [&](double share, bool is_watched) {
      detail::add_to_drift(sums, share, pair_, period_s_);
      if (is_watched) largest_sum_s_ = std::max({largest_sum_s_, sums.up_s, sums.down_s});
    });
  }

  [[nodiscard]] PairLimits limits() const {
    PairLimits pair = pair_;
    pair.drift_limit_s = std::max(1.0, 3.0 * largest_sum_s_);
    return pair;
  }
  [[nodiscard]] CalibratedPair report(const std::vector<TorqueSource>& sources) const {
    return {.first = sources[pair_.first].name,
            .second = sources[pair_.second].name,
            .largest_difference_Nm = largest_Nm_,
            .typical_threshold_Nm = detail::threshold_without_ceiling(pair_, median_Nm_),
            .largest_torque_Nm = std::min(first_torque_Nm_, second_torque_Nm_),
            .detected_in_these_states_Nm = largest_Nm_ + largest_threshold_Nm_,
            .is_factor_from_floor = is_factor_from_floor_};
  }
  /// Blocks with small error bars, which are at least half of the samples.
  [[nodiscard]] std::size_t blocks() const { return small_.size(); }

 private:
  [[nodiscard]] bool is_valid(const std::vector<SourceRun>& runs, std::size_t n) const {
    return runs[pair_.first].is_valid(n) && runs[pair_.second].is_valid(n);
  }
  [[nodiscard]] double difference(const std::vector<SourceRun>& runs, std::size_t n) const {
    return runs[pair_.first].value_Nm[n] - runs[pair_.second].value_Nm[n];
  }
  [[nodiscard]] double spread(const std::vector<SourceRun>& runs, std::size_t n) const {
    return detail::difference_std_dev(runs[pair_.first].std_dev_Nm[n],
                                      runs[pair_.second].std_dev_Nm[n], correlation_);
  }
  /// Difference over threshold of each valid sample, and whether the pair is watched.
  template <class See>
  void each_share(const std::vector<SourceRun>& runs, const See& see) const {
    bool is_watched = false;
    for (std::size_t n = 0; n < runs[0].value_Nm.size(); ++n) {
      if (!is_valid(runs, n)) continue;
      const double threshold_Nm = detail::threshold_without_ceiling(pair_, spread(runs, n));
      is_watched = is_watched || threshold_Nm <= pair_.largest_armed_Nm;
      see(difference(runs, n) / std::min(threshold_Nm, pair_.ceiling_Nm), is_watched);
    }
  }

  PairLimits pair_;
  double correlation_;
  double period_s_;
  std::size_t window_;
  BlockMaxima small_;  ///< |d| where the error bars are small
  BlockMaxima large_;  ///< |d| / s where they are large
  std::vector<double> spreads_;
  double median_Nm_ = kNotMeasured;
  double largest_Nm_ = 0.0;
  double first_torque_Nm_ = 0.0;  ///< largest of each source
  double second_torque_Nm_ = 0.0;
  double largest_threshold_Nm_ = 0.0;
  double largest_mean_ = 0.0;
  double largest_sum_s_ = 0.0;
  bool is_factor_from_floor_ = false;
};

/// The limits of the signals.
class SignalStatistics {
 public:
  SignalStatistics(const std::vector<MonitoredSignal>& signals, double rate_Hz)
      : signals_(signals), states_(signals.size()), rate_Hz_(rate_Hz) {
    for (const MonitoredSignal& signal : signals) {
      spec_.inputs.push_back(signal.name);
      const auto companion = std::ranges::find(signals, signal.moves_with, &MonitoredSignal::name);
      companions_.push_back(static_cast<std::size_t>(companion - signals.begin()));
    }
  }

  void see(const Recording& recording) {
    FeaturePipeline pipeline(spec_, rate_Hz_);
    std::vector<const Channel*> channels;
    for (const std::string& name : pipeline.raw_inputs())
      channels.push_back(&recording.channel(name));
    std::vector<double> raw(channels.size());
    std::vector<std::size_t> ages(channels.size(), 0);
    for (State& state : states_) state.is_started = false;
    for (std::size_t n = 0; n < recording.size(); ++n) {
      for (std::size_t k = 0; k < channels.size(); ++k) {
        raw[k] = channels[k]->values[n];
        ages[k] = channels[k]->is_fresh(n) ? 0 : ages[k] + 1;
        longest_gap_ = std::max(longest_gap_, ages[k]);
      }
      const std::span<const double> values = pipeline.step(raw);
      for (std::size_t i = 0; i < values.size(); ++i) see(states_[i], values, i);
    }
  }

  [[nodiscard]] std::vector<MonitoredSignal> limits() const {
    std::vector<MonitoredSignal> limits = signals_;
    for (std::size_t i = 0; i < limits.size(); ++i) {
      const State& state = states_[i];
      MonitoredSignal& signal = limits[i];
      const double margin = kRangeMargin * (state.highest - state.lowest);
      if (std::isinf(signal.lowest)) signal.lowest = state.lowest - margin;
      if (std::isinf(signal.highest)) signal.highest = state.highest + margin;
      if (!(signal.lowest < signal.highest))
        throw Error({.place = "monitor: " + signal.name,
                     .problem = "the signal is constant in the fault-free recordings",
                     .advice = "record it while the joint moves, or give its range"});
      if (std::isinf(signal.largest_rate))
        signal.largest_rate = 1.5 * state.largest_step * rate_Hz_;
      if (std::isinf(signal.longest_age_s))
        signal.longest_age_s = 1.5 * static_cast<double>(longest_gap_ + 1) / rate_Hz_;
      if (!signal.moves_with.empty() && std::isinf(signal.largest_hidden_travel))
        signal.largest_hidden_travel = 2.0 * std::max(state.hidden_travel, state.companion_step);
      if (!(signal.largest_hidden_travel > 0.0))
        throw Error({.place = "monitor: " + signal.name,
                     .problem = fmt::format("{}, with which it is to move, is constant in the "
                                            "fault-free recordings",
                                            signal.moves_with),
                     .advice = "record it while the joint moves"});
    }
    return limits;
  }

 private:
  struct State {
    double lowest = std::numeric_limits<double>::infinity();
    double highest = -std::numeric_limits<double>::infinity();
    double largest_step = 0.0;
    double hidden_travel = 0.0;
    double companion_step = 0.0;
    double last = 0.0;
    double companion = 0.0;
    double last_companion = 0.0;
    bool is_started = false;
  };

  void see(State& state, std::span<const double> values, std::size_t i) const {
    const double value = values[i];
    if (!std::isfinite(value)) return;
    const bool has_companion = companions_[i] < values.size();
    const double companion = has_companion ? values[companions_[i]] : 0.0;
    state.lowest = std::min(state.lowest, value);
    state.highest = std::max(state.highest, value);
    if (state.is_started) {
      state.largest_step = std::max(state.largest_step, std::abs(value - state.last));
      state.companion_step =
          std::max(state.companion_step, std::abs(companion - state.last_companion));
    }
    if (!state.is_started || value != state.last) state.companion = companion;
    state.hidden_travel = std::max(state.hidden_travel, std::abs(companion - state.companion));
    state.last = value;
    state.last_companion = companion;
    state.is_started = true;
  }

  std::vector<MonitoredSignal> signals_;
  std::vector<State> states_;
  std::vector<std::size_t> companions_;  ///< beyond the last signal: none
  FeatureSpec spec_;
  double rate_Hz_;
  std::size_t longest_gap_ = 0;
};

void check_arguments(const std::vector<SourceModel>& sources, const MonitorPlan& plan,
                     const Dataset& fault_free, const CalibrationOptions& options) {
  if (!(options.false_alarms_per_hour > 0.0) || !std::isfinite(options.false_alarms_per_hour))
    throw UsageError({.place = "wanted rate of false alarms",
                      .expected = "a positive number per hour",
                      .found = fmt::format("{}", options.false_alarms_per_hour)});
  if (!(options.persistence_s > 0.0) || !std::isfinite(options.persistence_s))
    throw UsageError({.place = "persistence of a difference",
                      .expected = "more than 0 s",
                      .found = fmt::format("{} s", options.persistence_s)});
  if (!(options.required_Nm > 0.0))
    throw UsageError({.place = "disagreement that a monitor has to find",
                      .expected = "more than 0 Nm",
                      .found = fmt::format("{} Nm", options.required_Nm)});
  if (!(options.least_threshold_Nm >= 0.0) || !std::isfinite(options.least_threshold_Nm))
    throw UsageError({.place = "smallest threshold of a monitor",
                      .expected = "0 Nm or more",
                      .found = fmt::format("{} Nm", options.least_threshold_Nm)});
  if (sources.size() != plan.sources.size() || sources.empty())
    throw Error({.place = "calibration of a monitor",
                 .expected = "one model for each source of the plan",
                 .found = fmt::format("{} and {}", sources.size(), plan.sources.size())});
  if (sources.size() < 2)
    throw Error({.place = "calibration of a monitor",
                 .expected = "at least two sources: a monitor compares them",
                 .found = "one"});
  for (const MonitoredSignal& signal : plan.signals) {
    if (signal.moves_with.empty()) continue;
    const auto companion =
        std::ranges::find(plan.signals, signal.moves_with, &MonitoredSignal::name);
    if (companion != plan.signals.end() && companion->name != signal.name) continue;
    throw UsageError({.place = "signal " + signal.name,
                      .expected = "to move with another signal that is watched as well",
                      .found = fmt::format("'{}'", signal.moves_with),
                      .advice = fmt::format("add --signal '{}'", signal.moves_with)});
  }
  if (fault_free.records.empty())
    throw Error({.place = "calibration of a monitor", .problem = "there is no recording"});
}

using Recorded = std::vector<std::vector<SourceRun>>;

Recorded run_all(const std::vector<SourceModel>& sources, const Dataset& fault_free,
                 const Progress& progress, double done) {
  const TorqueSources combined(sources);
  Recorded recorded;
  for (const DatasetRecord& record : fault_free.records) {
    report_progress(progress,
                    done + 0.5 * static_cast<double>(recorded.size()) /
                               static_cast<double>(fault_free.records.size()),
                    "calibration of the monitor");
    recorded.push_back(run_sources(combined, record.recording));
  }
  return recorded;
}

ErrorMoments moments_of(const Recorded& recorded, const Dataset& fault_free, std::size_t sources) {
  ErrorMoments moments(sources);
  for (std::size_t r = 0; r < recorded.size(); ++r) {
    const Recording& recording = fault_free.records[r].recording;
    if (!recording.has(fault_free.target)) continue;
    const Channel& measured = recording.channel(fault_free.target);
    std::vector<double> fresh(measured.values);
    for (std::size_t n = 0; n < fresh.size(); ++n)
      if (!measured.is_fresh(n)) fresh[n] = kNotMeasured;
    moments.add(recorded[r], fresh);
  }
  return moments;
}

[[noreturn]] void refuse_length(double duration_s) {
  throw Error({.place = "calibration of a monitor",
               .expected = fmt::format("at least {} s without a fault",
                                       kBlock_s * static_cast<double>(kLeastBlocks)),
               .found = fmt::format("{:.3g} s", duration_s)});
}

/// @returns whether the wanted rate is extrapolated
bool check_rate(const CalibrationOptions& options, double hours) {
  const double supported = 3.0 / hours;
  if (options.false_alarms_per_hour >= supported) return false;
  if (!options.extrapolate)
    throw Error(
        {.place = "wanted rate of false alarms",
         .expected = fmt::format("at least {:.3g} per hour: {:.3g} h without a fault support no "
                                 "smaller one (3 / T, 95 %)",
                                 supported, hours),
         .found = fmt::format("{:.3g} per hour", options.false_alarms_per_hour),
         .advice = "record longer, or permit an extrapolation, which the file then states"});
  return true;
}

}  // namespace

CalibratedMonitor calibrate_monitor(const std::vector<SourceModel>& sources,
                                    const MonitorPlan& plan, const Dataset& fault_free,
                                    const CalibrationOptions& options, const Progress& progress) {
  check_arguments(sources, plan, fault_free, options);
  const double rate_Hz = fault_free.sample_rate_Hz();
  CalibratedMonitor result;
  result.redundancy.sources = plan.sources;
  result.monitor.sample_period_s = 1.0 / rate_Hz;
  result.monitor.persistence_s = std::max(options.persistence_s, 2.0 / rate_Hz);
  std::size_t samples = 0;
  for (const DatasetRecord& record : fault_free.records) samples += record.recording.size();
  const double duration_s = static_cast<double>(samples) / rate_Hz;
  if (duration_s < kBlock_s * static_cast<double>(kLeastBlocks)) refuse_length(duration_s);
  result.hours = duration_s / kSecondsPerHour;
  result.false_alarms_per_hour = options.false_alarms_per_hour;
  result.is_extrapolated = check_rate(options, result.hours);

  SignalStatistics signals(plan.signals, rate_Hz);
  for (const DatasetRecord& record : fault_free.records) signals.see(record.recording);
  std::vector<SourceModel> scaled = sources;
  Recorded recorded = run_all(scaled, fault_free, progress, 0.0);
  // The error bars first, since a filter of the friction uses them.
  const ErrorMoments moments = moments_of(recorded, fault_free, sources.size());
  result.error_bar_factors = moments.sizes();
  for (std::size_t i = 0; i < sources.size(); ++i) {
    result.error_bar_factors[i] *= scaled[i].error_bar_factor;
    scaled[i].error_bar_factor = result.error_bar_factors[i];
  }
  recorded = run_all(scaled, fault_free, progress, 0.5);
  for (std::size_t i = 0; i < sources.size(); ++i) {
    std::map<Fault, std::size_t> guarded;
    for (const std::vector<SourceRun>& runs : recorded)
      for (const auto& [fault, count] : runs[i].guarded) guarded[fault] += count;
    std::size_t sum = 0;
    std::string faults;
    for (const auto& [fault, count] : guarded) {
      sum += count;
      faults += fmt::format("{}{} {:.1f} %", faults.empty() ? "" : ", ", name(fault),
                            100.0 * static_cast<double>(count) / static_cast<double>(samples));
    }
    result.guarded_share.push_back(static_cast<double>(sum) / static_cast<double>(samples));
    if (result.guarded_share[i] > kLargestGuardedShare)
      throw Error({.place = "source " + plan.sources[i].name,
                   .expected = "fault-free recordings within the range of its model",
                   .found = fmt::format("{:.1f} % of the samples with a fault ({})",
                                        100.0 * result.guarded_share[i], faults),
                   .advice = "train its model on recordings that cover this motion and load"});
  }
  const Redundancy redundancy({.sources = plan.sources, .correlation = {}});
  result.not_redundant = redundancy.names(parts_of_all(redundancy));
  result.redundancy.correlation = result.monitor.correlation =
      moments_of(recorded, fault_free, sources.size()).correlation();
  result.monitor.signals = signals.limits();
  for (const TorqueSource& source : plan.sources) result.monitor.sources.push_back(source.name);

  std::vector<PairStatistics> pairs;
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (std::size_t j = i + 1; j < sources.size(); ++j)
      pairs.emplace_back(
          PairLimits{.first = static_cast<std::uint8_t>(i), .second = static_cast<std::uint8_t>(j)},
          result.redundancy.correlation.empty()
              ? 0.0
              : result.redundancy.correlation[i * sources.size() + j],
          rate_Hz, result.monitor.persistence_s);
  for (PairStatistics& pair : pairs) {
    for (const std::vector<SourceRun>& runs : recorded) pair.see_spread(runs);
    for (const std::vector<SourceRun>& runs : recorded) pair.see_differences(runs);
  }
  // Floor and factor of every pair have the same share of the wanted rate.
  const double share = options.false_alarms_per_hour * kBlock_s / kSecondsPerHour /
                       (2.0 * static_cast<double>(std::max<std::size_t>(pairs.size(), 1)));
  for (PairStatistics& pair : pairs) {
    if (pair.blocks() < kLeastBlocks) refuse_length(static_cast<double>(pair.blocks()) * kBlock_s);
    pair.set_thresholds(share, options.least_threshold_Nm, options.required_Nm);
    for (const std::vector<SourceRun>& runs : recorded) pair.see_thresholds(runs);
    pair.set_ceiling(plan.sources);
    for (const std::vector<SourceRun>& runs : recorded) pair.see_drift(runs);
    pair.set_allowance();
    for (const std::vector<SourceRun>& runs : recorded) pair.see_sums(runs);
    result.monitor.pairs.push_back(pair.limits());
    result.pairs.push_back(pair.report(plan.sources));
  }
  return result;
}

}  // namespace torsio
