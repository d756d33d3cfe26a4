#pragma once

#include "files/output_file.hpp"
#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Writes a recording as an MCAP file of profile `ros2`: one message a sample in CDR, described by
/// `ros2msg`: `header.stamp`, `t_s`, the channels, and the freshness of channel `torque_Nm` as
/// `torque_fresh_1`. Chunks are packed by zstd and have an index. Time stamps count from the first
/// sample if that is before zero. Source: MCAP format specification; OMG, CDR.
/// Fields of ROS 2 have small letters, so that each has the name of its column as a comment.
/// @throws Error for an infinite value.
void write_mcap(const Recording& recording, OutputFile& file, const Progress& progress = {});

}  // namespace torsio
