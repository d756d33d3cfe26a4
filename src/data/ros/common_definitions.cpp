#include "data/ros/common_definitions.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace torsio {
namespace {

// A macro, since a definition contains those of its parts.
#define TORSIO_HEADER "===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
#define TORSIO_VECTOR "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
#define TORSIO_WRENCH \
  "===\nMSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n"
#define TORSIO_LAYOUT                                                                       \
  "===\nMSG: std_msgs/MultiArrayLayout\nstd_msgs/MultiArrayDimension[] dim\n"               \
  "uint32 data_offset\n===\nMSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\n" \
  "uint32 stride\n"

constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kDefinitions{
    {{"sensor_msgs/msg/JointState",
      "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
      "float64[] effort\n" TORSIO_HEADER},
     {"geometry_msgs/msg/WrenchStamped",
      "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n" TORSIO_HEADER TORSIO_WRENCH
          TORSIO_VECTOR},
     {"geometry_msgs/msg/Wrench",
      "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n" TORSIO_VECTOR},
     {"geometry_msgs/msg/Vector3Stamped",
      "std_msgs/Header header\ngeometry_msgs/Vector3 vector\n" TORSIO_HEADER TORSIO_VECTOR},
     {"geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
     {"sensor_msgs/msg/Temperature",
      "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n" TORSIO_HEADER},
     {"std_msgs/msg/Float64", "float64 data\n"},
     {"std_msgs/msg/Float32", "float32 data\n"},
     {"std_msgs/msg/Int32", "int32 data\n"},
     {"std_msgs/msg/Int64", "int64 data\n"},
     {"std_msgs/msg/UInt16", "uint16 data\n"},
     {"std_msgs/msg/Bool", "bool data\n"},
     {"std_msgs/msg/Float64MultiArray",
      "std_msgs/MultiArrayLayout layout\nfloat64[] data\n" TORSIO_LAYOUT},
     {"std_msgs/msg/Float32MultiArray",
      "std_msgs/MultiArrayLayout layout\nfloat32[] data\n" TORSIO_LAYOUT}}};

#undef TORSIO_HEADER
#undef TORSIO_VECTOR
#undef TORSIO_WRENCH
#undef TORSIO_LAYOUT

}  // namespace

std::string_view common_definition(std::string_view type) noexcept {
  const auto* const at =
      std::ranges::find(kDefinitions, type, &std::pair<std::string_view, std::string_view>::first);
  return at == kDefinitions.end() ? std::string_view{} : at->second;
}

}  // namespace torsio
