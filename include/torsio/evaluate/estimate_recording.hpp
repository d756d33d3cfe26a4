#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/estimate/torque_estimator.hpp"

namespace torsio {

/// The estimates of a recording, whose target need not be measured.
struct EstimatedRecording {
  /// On the clock of the recording: the raw inputs, the estimate ("estimated_torque_Nm"), its
  /// error bar ("torque_std_dev_Nm") and the novelty ("novelty_1", NaN for a model without one).
  Recording channels;
  std::vector<Fault> faults;  ///< one for each sample
};

/// The names of these two channels for a target such as "torque_Nm".
[[nodiscard]] std::string estimate_channel(const std::string& target);
[[nodiscard]] std::string error_bar_channel(const std::string& target);

/// Streams the recording through the estimator from `reset()`, as a loop would. A raw input that is
/// NaN in a sample is the fault `input_not_finite` there. The zeros of the recording are already
/// subtracted; a channel without its zero is the fault `zero_not_set` in every sample.
/// @throws Error if a raw input is missing or the recording has another sample rate than the
/// estimator; Cancelled.
[[nodiscard]] EstimatedRecording estimate_recording(Estimator estimator, const Recording& recording,
                                                    const Progress& progress = {});

/// Totals over the samples of a recording.
struct EstimateSummary {
  struct OfFault {
    Fault fault = Fault::none;
    std::size_t samples = 0;
  };
  std::string recording;
  double sample_rate_Hz = 0.0;
  std::size_t samples = 0;
  std::vector<OfFault> faults;  ///< those that occurred, `none` first where it did
  /// The extremes over the samples without a fault, in the target's unit; NaN if there is none.
  double lowest = kNotMeasured;
  double highest = kNotMeasured;
  double largest_std_dev = kNotMeasured;

  /// Share of the samples without a fault.
  [[nodiscard]] double usable_share() const noexcept;
};
[[nodiscard]] EstimateSummary summary_of(const EstimatedRecording& estimated,
                                         const std::string& target);

/// How a table contains the faults of its samples.
enum class FaultColumn {
  name,    ///< "fault": by name, and the recording as last column
  number,  ///< "fault_1": as `Fault`; the recording only where there are several, so that the
           ///< table of one can be read as a recording
};

/// Writes `t_s`, every channel (not the novelty of a model without one) and the faults. "-" is standard output; a file appears under
/// its name only when it is complete.
/// @throws Error if it cannot be written, or the recordings differ in their channels.
void write_estimates(const std::vector<EstimatedRecording>& recordings, const std::string& path,
                     FaultColumn fault = FaultColumn::name);

}  // namespace torsio
