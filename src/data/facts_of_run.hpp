#pragma once

#include <string>
#include <utility>
#include <vector>

#include "data/log_table.hpp"
#include "torsio/data/dataset.hpp"
#include "torsio/data/load.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

/// The clock of a format whose stamps are never even, with a note, where the mapping does not state one.
/// @param rate_Hz of the user; 0: none
void use_rate_of_format(LogTable& table, Mapping& mapping, double rate_Hz);

/// The conditions of the manifest, then those of the file that it does not state.
void add_conditions(Recording& recording, const ManifestFile& entry,
                    const std::vector<std::pair<std::string, double>>& of_file);

/// Recordings that their files give the same name also get the names of their files.
void name_twins_by_file(std::vector<DatasetRecord>& records);

}  // namespace torsio
