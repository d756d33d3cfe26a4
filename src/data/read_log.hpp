#pragma once

#include <string>
#include <vector>

#include "data/csv/csv_table.hpp"
#include "data/log_table.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

struct ReadLogOptions {
  std::vector<std::string> skip = {};  ///< columns of a CSV file that may hold anything
  /// Columns that are needed, of a file with many topics; empty: all.
  std::vector<std::string> wanted = {};
  Progress progress = {};
  CsvRules csv = {};
};

/// A log of any format, which its first bytes show: CSV; messages in MCAP, in a database or folder of
/// rosbag2, in a bag of ROS 1; arrays in `.npz` and `.mat`; JSON of BAM. All but `.mat` may be packed by gzip or zstd. "-" is
/// standard input.
/// @throws Error as the readers of the formats, and for a known format that is not read.
[[nodiscard]] LogTable read_log(const std::string& path, const ReadLogOptions& options = {});

}  // namespace torsio
