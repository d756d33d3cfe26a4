#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/estimate/monitored_torque.hpp"

namespace torsio {

/// The combined torque without one source, against the best one of those left.
struct AccuracyWithout {
  std::string source;
  double mean_ratio = kNotMeasured;
  double largest_ratio = kNotMeasured;
};

/// Errors of the combined torque and of each source against the torque on the load side without the
/// noise of a load cell, at the delay of the sources (`with_source_delay`). Root mean squares over
/// the runs' samples in which all are valid.
struct FusedAccuracy {
  std::string actuator;
  std::size_t runs = 0;
  std::vector<std::string> sources;
  std::vector<double> source_rmse_Nm;  ///< means of the runs
  double fused_rmse_Nm = 0.0;          ///< likewise
  std::string best;  ///< source with the smallest error in the first runs, not counted here
  /// The error of the combined torque over that of `best`: mean and largest of the runs.
  double mean_ratio = kNotMeasured;
  double largest_ratio = kNotMeasured;
  double within_std_dev = 0.0;  ///< share of the samples whose error is within the error bar
  double within_2_std_dev = 0.0;
  std::vector<AccuracyWithout> without;
};

/// Runs of `duration_s` of work without impacts at random temperatures and loads, and a quarter as
/// many before them in which the best source is chosen. @throws Error, Cancelled.
[[nodiscard]] FusedAccuracy fused_accuracy(const DataSheet& sheet, const MonitoredTorque& monitored,
                                           std::size_t runs, std::uint64_t seed,
                                           double duration_s = 60.0, const Progress& progress = {});

}  // namespace torsio
