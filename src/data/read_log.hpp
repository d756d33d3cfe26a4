#pragma once

#include <string>
#include <vector>

#include "data/log_table.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

struct ReadLogOptions {
  std::vector<std::string> skip = {};  ///< columns of a CSV file that may hold anything
  /// Columns that are needed, of a file with many topics; empty: all.
  std::vector<std::string> wanted = {};
  Progress progress = {};
};

/// A log of any format, which its first bytes show: CSV, plain or gzipped; messages in MCAP, in a
/// database or folder of rosbag2, in a bag of ROS 1; arrays in `.npz` and `.mat`. "-" is standard
/// input.
/// @throws Error as the readers of the formats, and for an HDF5 file.
[[nodiscard]] LogTable read_log(const std::string& path, const ReadLogOptions& options = {});

}  // namespace torsio
