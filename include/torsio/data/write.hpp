#pragma once

#include <string>
#include <string_view>

#include "torsio/core/progress.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// Writes `t_s`, every channel, and the freshness of a channel `torque_Nm` as `torque_fresh_1`, in the
/// format that the ending of `path` names: `.mcap` (one message a sample, for ROS 2, Foxglove and
/// PlotJuggler), `.npz` (numpy), `.mat` (MATLAB, as `save -v6`), otherwise CSV, packed if it ends in
/// `.gz`; "-" is CSV on standard output. All of them read back bit by bit by `load_recordings`. The
/// file appears under its name only when it is complete.
/// @throws Error if it cannot be written, or a name is none in that format; Cancelled.
void write_recording(const Recording& recording, const std::string& path,
                     const Progress& progress = {});

/// The endings that `write_recording` can write, for messages.
inline constexpr std::string_view kRecordingEndings = ".csv, .csv.gz, .mcap, .npz, .mat";

/// Writes `t_s` and every channel, each number with the fewest digits that read back bit by bit;
/// the freshness of channel `torque_Nm` becomes the column `torque_fresh_1`. "-" is standard
/// output; a file appears under its name only when it is complete.
/// @throws Error if it cannot be written, Cancelled if the progress asks to stop; then no file is
/// left.
void write_csv(const Recording& recording, const std::string& path, const Progress& progress = {});

}  // namespace torsio
