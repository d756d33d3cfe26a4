#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "data/byte_source.hpp"
#include "data/log_table.hpp"
#include "data/mcap/mcap_records.hpp"
#include "torsio/data/log_summary.hpp"

namespace torsio {

/// A file and its name in messages.
struct NamedBytes {
  std::string name;
  ByteSource* bytes = nullptr;
};

struct McapOptions {
  /// Names of the columns that are needed; the messages of other topics are not decoded. Empty: all.
  std::vector<std::string> wanted = {};
  McapLimits limits = {};
  std::size_t values = std::size_t{256} << 20;  ///< numbers, as in a CSV file
};

/// The numbers of an MCAP file, `ros2msg` and JSON, as a table. Its rows are the messages of the
/// topic that has most of them, its clock `t_s` their `header.stamp`, or where that is missing the
/// time at which they were recorded, from the first on. Columns of another topic hold its last
/// value before the row, and are fresh where a message has arrived since the row before; rows before
/// every topic has had a message are left out. A recording may be several files, in their order.
/// @throws Error naming the file, the message and what helps, also where `wanted` is in no topic.
[[nodiscard]] LogTable read_mcap(std::span<const NamedBytes> files, const std::string& name,
                                 const McapOptions& options = {});

[[nodiscard]] LogSummary list_mcap(std::span<const NamedBytes> files,
                                   const McapOptions& options = {});

}  // namespace torsio
