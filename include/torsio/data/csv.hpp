#pragma once

#include <string>

#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Writes `t_s` and every channel, each number with the fewest digits that read back bit by bit;
/// the freshness of channel `torque_Nm` becomes the column `torque_fresh_1`. "-" is standard
/// output; a file appears under its name only when it is complete.
/// @throws Error if it cannot be written, Cancelled if the progress asks to stop; then no file is
/// left.
void write_csv(const Recording& recording, const std::string& path, const Progress& progress = {});

}  // namespace torsio
