#pragma once

#include <string_view>

namespace torsio {

/// The definition, in `ros2msg`, of a message that joints are recorded in, such as
/// "sensor_msgs/msg/JointState", for files that do not contain it; empty for others.
/// Source: ROS 2, common_interfaces and std_msgs.
[[nodiscard]] std::string_view common_definition(std::string_view type) noexcept;

}  // namespace torsio
