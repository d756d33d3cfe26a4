#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

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

struct LogSummary {
  std::vector<TopicSummary> topics;
  bool is_unfinished = false;  ///< the recorder was stopped before it closed the file
  std::vector<std::pair<std::string, double>> conditions =
      {};  ///< facts about the whole file, in SI
  std::vector<std::pair<std::string, std::string>> labels = {};  ///< texts about the whole file
};

/// Topics and fields of an MCAP file or of the folder of rosbag2; of a log of BAM its entries, as one topic.
/// @throws Error for a file of another format.
[[nodiscard]] LogSummary list_log(const std::string& path, const Progress& progress = {});

}  // namespace torsio
