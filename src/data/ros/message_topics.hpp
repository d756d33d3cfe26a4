#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "data/log_summary.hpp"
#include "data/log_table.hpp"
#include "data/ros/message_source.hpp"

namespace torsio {

/// The topic and the schema of the messages that torsio writes.
inline constexpr std::string_view kOwnTopic = "/torsio";
inline constexpr std::string_view kOwnSchema = "torsio/msg/Sample";

/// A file of messages and its name in errors.
struct NamedMessages {
  std::string name;
  MessageSource* messages = nullptr;
};

struct TopicOptions {
  /// Names of the columns that are needed; the messages of other topics are not decoded. Empty: all.
  std::vector<std::string> wanted = {};
  std::size_t values = std::size_t{256} << 20;  ///< numbers, as in a CSV file
};

/// The numbers of messages of ROS (`ros2msg` in CDR, `ros1msg`) and JSON as a table. Its rows are the
/// messages of the topic that has most of them, and that hold the fields that are wanted; its clock `t_s` their
/// `header.stamp`, or where none has one the time at which they were recorded, from the first on. Columns of
/// another topic, or of other messages of the topic, hold the last value before the row, and are fresh where a
/// message has arrived since the row before; rows before every one has had a message are left out. A recording
/// may be several files, in their order. The fields of a topic that torsio wrote have the names and the clock
/// that its channels had. Messages that rosbag2 packed are unpacked.
/// @throws Error naming the file, the message and what helps, also where `wanted` is in no topic.
[[nodiscard]] LogTable table_of_messages(std::span<const NamedMessages> files,
                                         const std::string& name, const TopicOptions& options = {});

[[nodiscard]] LogSummary summary_of_messages(std::span<const NamedMessages> files,
                                             const TopicOptions& options = {});

}  // namespace torsio
