#pragma once

#include <string>
#include <vector>

#include "data/csv_table.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// The measured channels of a table as recordings in SI: columns, splitting, clock, holding,
/// latency and zeros, in this order. Derived channels come later (`add_derived`), behind resampling
/// and conditions. `rate_Hz` is the clock of a log that has none and whose mapping tells none;
/// `name` names the records, the file's own name if empty.
/// @throws Error naming place, expected, found and the mapping line that would help.
[[nodiscard]] std::vector<Recording> measured_recordings(const CsvTable& table,
                                                         const Mapping& mapping,
                                                         double rate_Hz = 0.0,
                                                         const std::string& name = {});

}  // namespace torsio
