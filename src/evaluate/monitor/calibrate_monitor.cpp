#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/report_progress.hpp"
#include "evaluate/monitor/combination_factors.hpp"
#include "evaluate/monitor/pair_calibration.hpp"
#include "evaluate/monitor/signal_statistics.hpp"
#include "evaluate/monitor/source_run.hpp"
#include "torsio/core/error.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"

namespace torsio {
namespace {

constexpr double kSecondsPerHour = 3600.0;
constexpr double kLargestGuardedShare = 0.01;
constexpr double kCombinationSegment_s = 60.0;
/// The correlation is known only from a finite record: it is taken a little towards none.
constexpr double kCorrelationShare = 0.95;
/// The share of the wanted rate of false alarms that pairs have; the limits of signals have the rest.
constexpr double kPairsShare = 0.8;

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

/// The recordings in which the torque was measured.
std::vector<MeasuredRun> measured_runs(const Recorded& recorded, const Dataset& fault_free) {
  std::vector<MeasuredRun> runs;
  for (std::size_t r = 0; r < recorded.size(); ++r) {
    const Recording& recording = fault_free.records[r].recording;
    if (!recording.has(fault_free.target)) continue;
    const Channel& measured = recording.channel(fault_free.target);
    MeasuredRun run{.sources = &recorded[r], .torque_Nm = measured.values};
    for (std::size_t n = 0; n < run.torque_Nm.size(); ++n)
      if (!measured.is_fresh(n)) run.torque_Nm[n] = kNotMeasured;
    runs.push_back(std::move(run));
  }
  return runs;
}

ErrorMoments moments_of(const std::vector<MeasuredRun>& runs, std::size_t sources) {
  ErrorMoments moments(sources);
  for (const MeasuredRun& run : runs) moments.add(*run.sources, run.torque_Nm);
  return moments;
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
  if (duration_s < kCalibrationBlock_s * static_cast<double>(kLeastCalibrationBlocks))
    refuse_calibration(duration_s);
  result.hours = duration_s / kSecondsPerHour;
  result.false_alarms_per_hour = options.false_alarms_per_hour;
  result.is_extrapolated = check_rate(options, result.hours);

  // The share of the blocks in which each of so many limits may be exceeded.
  const auto blocks_share = [&](double share_of_rate, std::size_t limits) {
    return share_of_rate * options.false_alarms_per_hour * kCalibrationBlock_s / kSecondsPerHour /
           static_cast<double>(limits);
  };
  SignalStatistics signals(plan.signals, rate_Hz);
  for (const DatasetRecord& record : fault_free.records) signals.add(record.recording);
  std::vector<SourceModel> scaled = sources;
  Recorded recorded = run_all(scaled, fault_free, progress, 0.0);
  // The error bars first, since a filter of the friction uses them.
  const ErrorMoments moments = moments_of(measured_runs(recorded, fault_free), sources.size());
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
  const std::vector<MeasuredRun> measured = measured_runs(recorded, fault_free);
  result.not_redundant = redundancy.names(parts_of_all(redundancy));
  result.redundancy.correlation = result.monitor.correlation =
      moments_of(measured, sources.size()).correlation();
  result.redundancy.error_bar_factors =
      combination_factors(result.redundancy, measured, samples_of(kCombinationSegment_s, rate_Hz));
  result.monitor.signals = signals.limits(
      blocks_share(1.0 - kPairsShare, SignalStatistics::kLimits * plan.signals.size()));
  for (const TorqueSource& source : plan.sources) result.monitor.sources.push_back(source.name);

  std::vector<PairLimits> pairs;
  for (std::size_t i = 0; i < sources.size(); ++i)
    for (std::size_t j = i + 1; j < sources.size(); ++j)
      pairs.push_back(
          {.first = static_cast<std::uint8_t>(i), .second = static_cast<std::uint8_t>(j)});
  PairChoice choice{.rate_Hz = rate_Hz,
                    .persistence_s = result.monitor.persistence_s,
                    .share = blocks_share(kPairsShare, 3 * pairs.size()),  // floor, factor, ceiling
                    .least_Nm = options.least_threshold_Nm,
                    .required_Nm = options.required_Nm};
  for (const PairLimits& pair : pairs) {
    if (!result.redundancy.correlation.empty())
      choice.correlation = result.redundancy.correlation[pair.first * sources.size() + pair.second];
    const PairCalibration calibrated = calibrate_pair(pair, plan.sources, recorded, choice);
    result.monitor.pairs.push_back(calibrated.limits);
    result.pairs.push_back(calibrated.report);
  }
  return result;
}

}  // namespace torsio
