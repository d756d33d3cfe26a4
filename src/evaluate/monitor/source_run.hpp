#pragma once

#include <cmath>
#include <cstddef>
#include <map>
#include <vector>

#include "torsio/data/recording.hpp"
#include "torsio/estimate/torque_sources.hpp"
#include "torsio/safety/redundancy.hpp"

namespace torsio {

/// One source over a recording.
struct SourceRun {
  std::vector<double> value_Nm;
  std::vector<double> std_dev_Nm;        ///< NaN where the source has a fault
  std::map<Fault, std::size_t> guarded;  ///< samples with a fault after the filters have settled

  [[nodiscard]] bool is_valid(std::size_t sample) const noexcept {
    return std_dev_Nm[sample] > 0.0;
  }
};

/// A zero that was subtracted from the recording is not subtracted again. Without effect on
/// channels that the sources do not read.
void take_zeros(TorqueSources& sources, const Recording& recording);

/// The parts on which every source depends, such as the supply.
[[nodiscard]] PartSet parts_of_all(const Redundancy& redundancy);

/// All sources over a recording, from `reset()`. @throws Error if a channel is missing.
[[nodiscard]] std::vector<SourceRun> run_sources(TorqueSources sources, const Recording& recording);

}  // namespace torsio
