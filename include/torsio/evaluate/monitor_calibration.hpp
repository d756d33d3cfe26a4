#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "torsio/core/progress.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/estimate/torque_sources.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"

namespace torsio {

/// What a monitor is to watch. Limits of a signal that are not set (infinite) come from the data.
struct MonitorPlan {
  std::vector<TorqueSource> sources;     ///< in the order of their estimators
  std::vector<MonitoredSignal> signals;  ///< expressions of channels
};

struct CalibrationOptions {
  /// The wanted rate of false alarms of all pairs of sources together.
  double false_alarms_per_hour = 1.0;
  /// T hours without a fault support no rate below 3 / T (95 %). A smaller one is refused, or, with
  /// this, extrapolated from the tail of the differences and labelled so.
  bool extrapolate = false;
  /// No pair has a smaller threshold, however well its sources agree in these recordings: what they
  /// do not contain, as another temperature or age, makes them differ more.
  double least_threshold_Nm = 0.0;
  /// How long a difference must exceed its threshold; at least two samples. The filters of the
  /// sources spread one wrong sample over their settling time.
  double persistence_s = MonitorSettings().persistence_s;
  /// A disagreement that has to be found: the monitor is not ready while error bars make a
  /// threshold larger than 0.8 times this (but never at less than 1.1 times the threshold of small
  /// error bars).
  double required_Nm = std::numeric_limits<double>::infinity();
};

/// The limits of one pair of sources, in words of the data.
struct CalibratedPair {
  std::string first;
  std::string second;
  double largest_difference_Nm = 0.0;  ///< in the fault-free recordings
  double typical_threshold_Nm = 0.0;   ///< median over the recordings
  /// That both sources reach. A threshold above it finds no fault in such work.
  double largest_torque_Nm = 0.0;
  /// A fault that changes the difference by this is found in any of the states of these recordings,
  /// even where the fault-free difference has the opposite sign: largest difference and largest
  /// threshold. In a state with wider error bars the threshold is larger, up to the ceiling of
  /// the pair.
  double detected_in_these_states_Nm = 0.0;
  /// Error bars were above their median in fewer than ten blocks: the factor is the floor over the
  /// median.
  bool is_factor_from_floor = false;
};

struct CalibratedMonitor {
  /// Per source, for `SourceModel::error_bar_factor`: the root mean square of its errors in
  /// units of their standard deviations, where the torque was measured; else the factor that the model
  /// had.
  std::vector<double> error_bar_factors;
  RedundancySettings redundancy;
  MonitorSettings monitor;
  std::vector<CalibratedPair> pairs;
  /// Parts on which every source depends: no comparison covers them.
  std::vector<std::string> not_redundant;
  std::vector<double> guarded_share;  ///< per source: share of the samples with a fault
  double hours = 0.0;                 ///< length of the fault-free recordings
  double false_alarms_per_hour = 0.0;
  bool is_extrapolated = false;
};

/// The limits of a monitor from fault-free recordings of the joint.
///
/// - Pair of sources: with d the difference and s its standard deviation from the error bars, h =
///   min(max(floor, factor s), ceiling). |d| and |d| / s are reduced to what persists for
///   `persistence_s`; the floor comes from the first where s is at most its median, the factor from
///   the second where it is above. The maxima of blocks of 10 s have a generalised Pareto tail
///   above their 90 % quantile, which gives the threshold for the wanted rate, at least 1.05 times
///   the largest one observed. The ceiling is 1.25 times the largest h since
///   the pair was first narrow enough to be armed. If a required disagreement is given, it is at most
///   the largest of the floor, 0.8 times what is required, and the threshold of |d| in every state, so
///   that error bars that grow further do not hide what has to be found.
/// - Error bars, correlation of the sources' errors and factors of the combination: where the
///   recordings have the measured torque.
/// - Signals: range with 0.4 of its width on either side; 1.5 times the largest rate; five times the
///   longest travel of a companion without a change; each of them at least what the tail of its
///   maxima over blocks, as for pairs, exceeds at the wanted rate. 1.5 times the longest gap between
///   fresh samples (at least a sample).
/// - Drift: what is allowed is 1.2 times the largest size of a mean of d / h over a minute, limited
///   to 0.75 to 0.95; the limit is 3 times the largest cumulative sum, at least 1 s.
///
/// Four fifths of the wanted rate belong to the pairs, the rest to the signals, in equal shares.
/// Form: ours; tails: Pickands 1975, their moments Hosking and Wallis 1987.
/// @throws Error if there are fewer than two sources, if the recordings lack a channel, are shorter
/// than ten blocks, cannot support the wanted rate, or if a source has a fault in more than 1 % of the samples; UsageError for a rate
/// that is not positive or a signal whose companion is not a signal; Cancelled.
[[nodiscard]] CalibratedMonitor calibrate_monitor(const std::vector<SourceModel>& sources,
                                                  const MonitorPlan& plan,
                                                  const Dataset& fault_free,
                                                  const CalibrationOptions& options = {},
                                                  const Progress& progress = {});

}  // namespace torsio
