#pragma once

#include <string>
#include <vector>

#include "data/log_table.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// The measured channels of a table as recordings in SI: columns, splitting, clock, holding,
/// latency and zeros, in this order. Derived channels are added later (`add_derived`), after
/// resampling and conditions. `rate_Hz` is the sample rate of a log without clock whose mapping
/// gives none; `name` names the recordings, the file's name if empty.
/// @throws Error naming place, expected, found and the mapping line that helps.
[[nodiscard]] std::vector<Recording> measured_recordings(LogTable table, const Mapping& mapping,
                                                         double rate_Hz = 0.0,
                                                         const std::string& name = {});

}  // namespace torsio
