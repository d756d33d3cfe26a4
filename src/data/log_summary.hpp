#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "data/log_table.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// A topic of a file, for a list of what there is.
struct TopicSummary {
  std::string topic;
  std::string schema;
  std::string encoding;
  std::size_t messages = 0;
  std::int64_t first_ns = 0;        ///< time stamp of the first message
  std::int64_t last_ns = 0;         ///< the latest
  std::int64_t largest_gap_ns = 0;  ///< between two messages
  std::vector<std::string> fields;  ///< columns; empty if the messages cannot be decoded
  std::string problem;              ///< why they cannot
};

/// Where the unit of a column is written.
enum class UnitOrigin : std::uint8_t { none, name, brackets, row_of_units, dates };
[[nodiscard]] std::string_view name(UnitOrigin origin) noexcept;

/// A column of a CSV file or an array, for a list of what there is; numbers as the file has them.
struct ColumnSummary {
  std::string name;
  std::string unit = {};  ///< suffix; empty: not known
  UnitOrigin unit_origin = UnitOrigin::none;
  std::size_t measured = 0;  ///< rows with a number
  std::size_t empty = 0;
  std::size_t fresh = 0;  ///< values that differ from the one before, or that the file marks as new
  double lowest = 0.0;    ///< among the rows with a number
  double highest = 0.0;
  std::vector<double> first = {};  ///< the first ones
};

struct LogSummary {
  std::vector<TopicSummary> topics = {};
  std::vector<ColumnSummary> columns = {};  ///< where the file has no topics
  std::size_t rows = 0;
  std::string clock = {};   ///< the column of the time stamps; empty: none that shows it
  double duration_s = 0.0;  ///< by the clock; 0: its unit is not known
  std::vector<std::string> not_read = {};  ///< with the reason
  std::vector<std::string> notes = {};     ///< what reading assumed, in sentences
  bool is_unfinished = false;              ///< the recorder was stopped before it closed the file
  std::vector<std::pair<std::string, double>> conditions =
      {};  ///< facts about the whole file, in SI
  std::vector<std::pair<std::string, std::string>> labels = {};  ///< texts about the whole file
};

/// Columns as they are in the file.
[[nodiscard]] std::vector<ColumnSummary> column_summaries(const LogTable& table);

/// Topics and fields of an MCAP file or of the folder of rosbag2; of a log of BAM its entries, as one topic; columns of
/// a CSV file and arrays of `.npz` and `.mat`.
/// @throws Error as `read_log`.
[[nodiscard]] LogSummary list_log(const std::string& path, const Progress& progress = {});

}  // namespace torsio
