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

/// A log of any format, which its first bytes show: CSV, plain or gzipped, MCAP (plain, or as the
/// folder of rosbag2). "-" is standard input.
/// @throws Error as `read_csv` and `read_mcap`, and for formats that are recognised but not read.
[[nodiscard]] LogTable read_log(const std::string& path, const ReadLogOptions& options = {});

}  // namespace torsio
