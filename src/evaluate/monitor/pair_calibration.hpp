#pragma once

#include <cstddef>
#include <vector>

#include "evaluate/monitor/source_run.hpp"
#include "torsio/evaluate/monitor_calibration.hpp"

namespace torsio {

inline constexpr double kCalibrationBlock_s = 10.0;
inline constexpr std::size_t kLeastCalibrationBlocks = 10;

/// @throws Error: too few blocks without a fault.
[[noreturn]] void refuse_calibration(double duration_s);

struct PairCalibration {
  PairLimits limits;
  CalibratedPair report;
};

/// Samples of a time, as many at least.
[[nodiscard]] std::size_t samples_of(double seconds, double rate_Hz);

/// How the limits of a pair of sources are chosen.
struct PairChoice {
  double correlation = 0.0;  ///< correlation of the errors of both sources
  double rate_Hz = 0.0;
  double persistence_s = 0.0;
  double share =
      0.0;  ///< share of the blocks in which floor, factor and ceiling may each be exceeded
  double least_Nm = 0.0;     ///< the smallest threshold
  double required_Nm = 0.0;  ///< see `CalibrationOptions`
};

/// Threshold, ceiling and limits of the drift of one pair from the outputs of all sources in each recording.
/// @param pair indices of both sources
/// @throws Error if the error bars are never narrow enough to arm the pair, or too few blocks are there.
[[nodiscard]] PairCalibration calibrate_pair(const PairLimits& pair,
                                             const std::vector<TorqueSource>& sources,
                                             const std::vector<std::vector<SourceRun>>& recorded,
                                             const PairChoice& choice);

}  // namespace torsio
