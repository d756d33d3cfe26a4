#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "data/little_endian.hpp"
#include "data/ros/ros_schema.hpp"
#include "data/ros/topic_table.hpp"

namespace torsio {

/// How the fields of a message follow each other.
enum class RosEncoding : std::uint8_t {
  cdr,   ///< ROS 2: after four bytes that name the encoding; numbers are aligned to their size
  ros1,  ///< without gaps
};

/// Numbers of the messages of one topic, each field a column: "/topic/field/sub",
/// "/topic/field/2" for an element. Where a message has texts `name`, as `sensor_msgs/JointState`
/// does, the elements of its other arrays are called by them, whatever their order:
/// "/joint_states/elbow/position". Texts, raw bytes and elements after the hundredth are skipped.
/// Source: OMG, CDR; ROS 2 interface
/// definition; ROS 1, message serialisation.
class RosDecoder {
 public:
  RosDecoder(std::string topic, RosSchema schema, RosEncoding encoding = RosEncoding::cdr);

  /// Sets the fields of a message in the row of `table`.
  /// @returns false if the message ends too early, or is not in that encoding, little-endian; the row
  /// is then dropped
  /// @throws Error beyond the budget of the file.
  bool decode(std::string_view message, TopicTable& table, ReadBudget& budget);

  /// The `header.stamp` in the last message; 0 if it has none.
  [[nodiscard]] std::int64_t stamp_ns() const noexcept { return stamp_ns_; }

 private:
  /// A field in the messages, with its column, which is found once.
  struct Place {
    std::string name;
    std::optional<std::size_t> column = {};
    std::vector<Place> parts = {};  ///< fields of a message, elements of an array
    std::size_t names_version = 0;  ///< that the parts were named by
  };

  bool align(std::size_t size) noexcept {
    return encoding_ == RosEncoding::ros1 || reader_.align(size);
  }
  template <class Number>
  [[nodiscard]] std::optional<double> read_as_double();
  bool decode_type(std::size_t type, Place& place);
  bool decode_field(const RosField& field, Place& place);
  bool decode_elements(const RosField& field, std::size_t count, Place& place);
  bool decode_one(const RosField& field, Place& place);
  bool decode_names(std::size_t count);
  bool decode_time(Place& place);
  bool skip(const RosField& field, std::size_t count);
  [[nodiscard]] bool is_time(const RosField& field) const;
  [[nodiscard]] std::optional<double> number(RosKind kind);
  [[nodiscard]] Place& element(Place& place, const RosField& field, std::size_t index) const;
  void add_part(Place& place, std::string name) const;

  std::string topic_;
  RosSchema schema_;
  RosEncoding encoding_;
  Place root_;
  LittleEndianReader reader_{{}};
  TopicTable* table_ = nullptr;
  ReadBudget* budget_ = nullptr;
  std::vector<std::string> names_;
  std::size_t names_version_ = 0;  ///< counts the changes of `names_`
  std::int64_t stamp_ns_ = 0;
};

}  // namespace torsio
