#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "data/read_budget.hpp"

namespace torsio {

struct MessageSchema {
  std::string name;      ///< "sensor_msgs/msg/JointState"
  std::string encoding;  ///< form of the definition: "ros2msg", "ros1msg", "jsonschema", ..
  std::string definition;
};

struct MessageChannel {
  std::string topic;
  std::string encoding;  ///< form of the messages: "cdr", "ros1", "json", ..
  MessageSchema schema;  ///< empty if it has none
};

struct LogMessage {
  const MessageChannel* channel = nullptr;  ///< valid as long as the source
  std::int64_t log_time_ns = 0;
  std::string_view data;  ///< valid until the next message
};

/// The messages of a file in its order, whatever its format.
class MessageSource {
 public:
  explicit MessageSource(ReadBudget budget) : budget_(std::move(budget)) {}
  virtual ~MessageSource() = default;
  /// @returns false at the end. @throws Error with the place where the file contradicts its format.
  virtual bool next(LogMessage& message) = 0;
  /// The file ended without the record that closes it; known at the end.
  [[nodiscard]] virtual bool is_unfinished() const noexcept { return false; }
  /// For all that is made of the messages, too.
  [[nodiscard]] ReadBudget& budget() noexcept { return budget_; }
  [[nodiscard]] const ReadBudget& budget() const noexcept { return budget_; }

 private:
  ReadBudget budget_;
};

}  // namespace torsio
