#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

enum class RosKind : std::uint8_t {
  boolean,
  int8,
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  text,
  nested
};

/// Bytes of a number, which is also its alignment in CDR; 0 for texts and nested messages.
[[nodiscard]] std::size_t bytes_of(RosKind kind) noexcept;

struct RosField {
  enum class Count : std::uint8_t { one, fixed, sequence };

  std::string name;
  RosKind kind = RosKind::float64;
  std::size_t type = 0;  ///< nested message: index in `RosSchema::types`
  Count count = Count::one;
  std::size_t size = 1;  ///< elements, if fixed
};

struct RosType {
  std::string name;  ///< "std_msgs/Header"
  std::vector<RosField> fields;
};

/// A message and all that it contains, as the text of a `ros2msg` or `ros1msg` schema defines them.
struct RosSchema {
  std::vector<RosType> types;  ///< the first is the message
};

/// @throws Error at `place` for a text that is not such a definition, an unknown type, a type that
/// contains itself, or wide texts.
[[nodiscard]] RosSchema parse_ros_schema(std::string_view name, std::string_view text,
                                         const std::string& place);

}  // namespace torsio
