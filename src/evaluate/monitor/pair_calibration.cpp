#include "evaluate/monitor/pair_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "evaluate/monitor/exceedance.hpp"
#include "numerics/quantile.hpp"
#include "safety/pair_difference.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr double kArmedShare = 0.8;  // threshold that is armed, over the required disagreement
constexpr double kCeilingMargin = 1.25;
/// The least ceiling, over the required disagreement: the rest is for a difference without a fault.
constexpr double kCeilingShare = 0.8;
constexpr double kDriftWindow_s = 60.0;

/// The differences of two sources in the recordings.
class PairStatistics {
 public:
  PairStatistics(const PairLimits& pair, double correlation, double rate_Hz, double persistence_s)
      : pair_(pair),
        correlation_(correlation),
        period_s_(1.0 / rate_Hz),
        window_(detail::persistent_samples(persistence_s, period_s_)),
        small_(samples_of(kCalibrationBlock_s, rate_Hz)),
        large_(samples_of(kCalibrationBlock_s, rate_Hz)),
        watched_(samples_of(kCalibrationBlock_s, rate_Hz)) {}

  void add_spreads(const std::vector<SourceRun>& runs) {
    constexpr std::size_t kMedianEvery = 97;  // the median needs no more
    for (std::size_t n = 0; n < runs[0].value_Nm.size(); n += kMedianEvery)
      if (is_valid(runs, n)) spreads_.push_back(spread(runs, n));
  }

  // A difference is found if |d| > floor and |d| > factor s in enough samples of a window. What persists is
  // therefore taken of each, and one of the two has to be prevented: which one is decided by s at
  // the end of the window.
  void add_differences(const std::vector<SourceRun>& runs) {
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
    is_factor_from_floor_ = large_.size() < kLeastCalibrationBlocks;
    pair_.floor_Nm = std::max(small_Nm, least_Nm);
    pair_.largest_armed_Nm = std::max(kArmedShare * required_Nm, 1.1 * pair_.floor_Nm);
    pair_.factor =
        std::max(is_factor_from_floor_ ? small_Nm / median_Nm_ : large_.threshold(share), 1.0);
  }

  /// The largest threshold while the pair is watched, which begins when it is narrow enough to be
  /// armed.
  void add_thresholds(const std::vector<SourceRun>& runs) {
    bool is_watched = false;
    for (std::size_t n = 0; n < runs[0].value_Nm.size(); ++n) {
      if (!is_valid(runs, n)) continue;
      const double threshold_Nm = detail::threshold_without_ceiling(pair_, spread(runs, n));
      is_watched = is_watched || threshold_Nm <= pair_.largest_armed_Nm;
      if (is_watched) largest_threshold_Nm_ = std::max(largest_threshold_Nm_, threshold_Nm);
    }
  }
  /// The differences in every state while the pair is watched.
  void add_watched(const std::vector<SourceRun>& runs) {
    bool is_watched = false;
    std::vector<double> sizes(runs[0].value_Nm.size(), kNotMeasured);
    for (std::size_t n = 0; n < sizes.size(); ++n) {
      if (!is_valid(runs, n)) continue;
      is_watched = is_watched || detail::threshold_without_ceiling(pair_, spread(runs, n)) <=
                                     pair_.largest_armed_Nm;
      if (is_watched) sizes[n] = std::abs(difference(runs, n));
    }
    watched_.add(persisting(sizes, window_));
  }
  /// @param share of the blocks in which the pair may exceed the ceiling
  void set_ceiling(double share, double required_Nm, const std::vector<TorqueSource>& sources) {
    if (largest_threshold_Nm_ == 0.0)
      throw Error({.place = fmt::format("pair {}, {}", sources[pair_.first].name,
                                        sources[pair_.second].name),
                   .expected = fmt::format("recordings in which the error bars permit a threshold "
                                           "of at most {:.3g} Nm at least once",
                                           pair_.largest_armed_Nm),
                   .found = "none: the monitor would never be ready",
                   .advice = "require a larger disagreement, or record a motion after which the "
                             "friction is known"});
    pair_.ceiling_Nm = std::min(
        kCeilingMargin * largest_threshold_Nm_,
        std::max({pair_.floor_Nm, watched_.threshold(share), kCeilingShare * required_Nm}));
  }

  void add_means(const std::vector<SourceRun>& runs) {
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

  void add_sums(const std::vector<SourceRun>& runs) {
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
            .detected_in_these_states_Nm =
                largest_Nm_ + std::min(largest_threshold_Nm_, pair_.ceiling_Nm),
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
  template <class Use>
  void each_share(const std::vector<SourceRun>& runs, const Use& use) const {
    bool is_watched = false;
    for (std::size_t n = 0; n < runs[0].value_Nm.size(); ++n) {
      if (!is_valid(runs, n)) continue;
      const double threshold_Nm = detail::threshold_without_ceiling(pair_, spread(runs, n));
      is_watched = is_watched || threshold_Nm <= pair_.largest_armed_Nm;
      use(difference(runs, n) / std::min(threshold_Nm, pair_.ceiling_Nm), is_watched);
    }
  }

  PairLimits pair_;
  double correlation_;
  double period_s_;
  std::size_t window_;
  BlockMaxima small_;    ///< |d| where the error bars are small
  BlockMaxima large_;    ///< |d| / s where they are large
  BlockMaxima watched_;  ///< |d| in every state
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

}  // namespace

std::size_t samples_of(double seconds, double rate_Hz) {
  return static_cast<std::size_t>(std::ceil(seconds * rate_Hz - 1e-9));
}

void refuse_calibration(double duration_s) {
  throw Error(
      {.place = "calibration of a monitor",
       .expected = fmt::format("at least {} s without a fault",
                               kCalibrationBlock_s * static_cast<double>(kLeastCalibrationBlocks)),
       .found = fmt::format("{:.3g} s", duration_s)});
}

PairCalibration calibrate_pair(const PairLimits& pair, const std::vector<TorqueSource>& sources,
                               const std::vector<std::vector<SourceRun>>& recorded,
                               const PairChoice& choice) {
  PairStatistics statistics(pair, choice.correlation, choice.rate_Hz, choice.persistence_s);
  for (const auto& runs : recorded) statistics.add_spreads(runs);
  for (const auto& runs : recorded) statistics.add_differences(runs);
  if (statistics.blocks() < kLeastCalibrationBlocks)
    refuse_calibration(static_cast<double>(statistics.blocks()) * kCalibrationBlock_s);
  statistics.set_thresholds(choice.share, choice.least_Nm, choice.required_Nm);
  for (const auto& runs : recorded) statistics.add_thresholds(runs);
  for (const auto& runs : recorded) statistics.add_watched(runs);
  statistics.set_ceiling(choice.share, choice.required_Nm, sources);
  for (const auto& runs : recorded) statistics.add_means(runs);
  statistics.set_allowance();
  for (const auto& runs : recorded) statistics.add_sums(runs);
  return {.limits = statistics.limits(), .report = statistics.report(sources)};
}

}  // namespace torsio
