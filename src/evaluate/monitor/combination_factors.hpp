#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "evaluate/monitor/source_run.hpp"
#include "torsio/safety/redundancy.hpp"

namespace torsio {

/// A fault-free recording: the sources over it, and the torque that was measured (NaN: not measured).
struct MeasuredRun {
  const std::vector<SourceRun>* sources;
  std::vector<double> torque_Nm;
};

/// `RedundancySettings::error_bar_factors` with which the combination is in no minute much worse than the
/// source that is best over all recordings.
///
/// The weights of smallest variance are best in the mean over many minutes. An error that persists, of a
/// stiffness or by the temperature, is common to the samples of a minute, so that in some minutes the
/// other sources add more error than they remove. All but the best one get the same factor: the smallest
/// one (among 1, 1.25, 1.5, 2, 3, 4, 6, 8) for which the root mean square error of the combination is at
/// most 1.01 times that of the best source in each segment of the recordings; 8 if none achieves that.
/// @param segment samples of a minute
/// @returns one factor for each source; empty if no recording has a measured torque
[[nodiscard]] std::vector<double> combination_factors(const RedundancySettings& settings,
                                                      std::span<const MeasuredRun> runs,
                                                      std::size_t segment);

}  // namespace torsio
