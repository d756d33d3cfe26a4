#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/core/realtime.hpp"
#include "torsio/estimate/torque_sources.hpp"
#include "torsio/safety/history.hpp"
#include "torsio/safety/monitor.hpp"
#include "torsio/safety/redundancy.hpp"
#include "torsio/signal/feature_pipeline.hpp"

namespace torsio {

/// The sources of a joint's torque, their combination and their monitor, fed with the channels of
/// the drive. A monitored signal is an expression of these channels ("gear_angle_rad -
/// joint_angle_rad"); its age is that of the oldest channel in it.
class MonitoredTorque {
 public:
  /// @param sources one for each of `redundancy.sources`, in that order
  /// @throws Error if these do not fit together, or as `Redundancy`, `Monitor` and
  /// `FeaturePipeline` do.
  MonitoredTorque(TorqueSources sources, const RedundancySettings& redundancy,
                  const MonitorSettings& monitor);

  /// The channels that `step` requires, in this order.
  [[nodiscard]] const std::vector<std::string>& raw_inputs() const noexcept { return raw_inputs_; }

  /// Subtracts `value` (SI) from a channel of every source and signal that uses it; call it while
  /// configuring. @throws UsageError for an unknown channel or a value that is not finite.
  void set_zero(std::string_view channel, double value);

  /// Empties the memory of the sources and signals. The monitor has a reset of its own,
  /// `monitor().reset(t_s)`, with which the next step begins the history again.
  void reset() noexcept;

  /// A sample that changes faster than a signal that is this channel alone can (`largest_rate`), or
  /// in a step that is a jump for a source, is not given to the sources, for fewer than
  /// `spikes_in_a_row` samples in a row: their filters would spread one spike over many ticks. They
  /// get the linear extrapolation of the two before it (`FusedTorque::has_replaced_input`), or after
  /// a gap, over which nothing is extrapolated, a missing sample.
  /// @param raw one sample for each of `raw_inputs()`. A channel older than the longest age of a
  /// signal that is this channel alone is not measured for the sources: their fault is
  /// input_not_finite. Another number of samples is a stop of the monitor.
  FusedTorque step(double t_s, std::span<const SignalSample> raw) noexcept TORSIO_REALTIME;

  [[nodiscard]] Monitor& monitor() noexcept { return monitor_; }
  [[nodiscard]] const Monitor& monitor() const noexcept { return monitor_; }
  [[nodiscard]] const Redundancy& redundancy() const noexcept { return redundancy_; }
  [[nodiscard]] TorqueSources& sources() noexcept { return sources_; }
  [[nodiscard]] const TorqueSources& sources() const noexcept { return sources_; }
  /// The last second, kept once the monitor has stopped; the columns are `history_columns()`.
  [[nodiscard]] const History& history() const noexcept { return history_; }
  [[nodiscard]] std::vector<std::string> history_columns() const;
  /// The estimates of the last step, one a source.
  [[nodiscard]] std::span<const Estimate> estimates() const noexcept {
    return sources_.estimates();
  }

 private:
  /// The limits of a channel that is a signal, and its last sample.
  struct ChannelGuard {
    double longest_age_s = std::numeric_limits<double>::infinity();
    double largest_step = std::numeric_limits<double>::infinity();  ///< from sample to sample
    double last = kNotMeasured;
    double change = 0.0;       ///< per sample, of the last ones that were not replaced
    std::uint32_t held = 0;    ///< samples that were not given to the sources since `last`
    std::uint64_t missed = 0;  ///< samples without a value since `last`
  };
  [[nodiscard]] double guarded(ChannelGuard& guard, const SignalSample& sample) const noexcept;
  [[nodiscard]] std::vector<std::size_t> places_of(const std::vector<std::string>& channels) const;
  void record(double t_s, const FusedTorque& fused, std::span<const SignalSample> raw) noexcept;

  TorqueSources sources_;
  Redundancy redundancy_;
  Monitor monitor_;
  FeaturePipeline signal_pipeline_;
  std::vector<std::string> raw_inputs_;  ///< first those of the sources
  std::vector<std::size_t> signal_places_;
  std::vector<std::vector<std::size_t>> channels_of_signal_;  ///< places in `raw`
  std::vector<ChannelGuard> guards_;                          ///< per channel
  std::vector<double> source_values_;
  std::vector<double> signal_values_;
  std::vector<SignalSample> signals_;
  std::vector<double> row_;  ///< a row of the history
  History history_;
};

}  // namespace torsio
