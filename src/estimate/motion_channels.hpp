#pragma once

#include <array>
#include <string_view>

namespace torsio {

/// What a channel of a model is in a simulated joint: gear * (gear side) + joint * (joint side), of angles or of speeds.
struct MotionChannel {
  std::string_view name;
  double gear = 0.0;
  double joint = 0.0;
  bool is_speed = false;
  bool is_of_motor = false;  ///< the gear side times the ratio of the gear
};

/// The channels that a simulator of rigid bodies has for each joint with a spring.
inline constexpr auto kMotionChannels = std::to_array<MotionChannel>({
    {.name = "gear_angle_rad", .gear = 1.0},
    {.name = "joint_angle_rad", .joint = 1.0},
    {.name = "spring_deflection_rad", .gear = 1.0, .joint = -1.0},
    {.name = "motor_angle_rad", .gear = 1.0, .is_of_motor = true},
    {.name = "gear_speed_rad_s", .gear = 1.0, .is_speed = true},
    {.name = "joint_speed_rad_s", .joint = 1.0, .is_speed = true},
    {.name = "spring_deflection_rate_rad_s", .gear = 1.0, .joint = -1.0, .is_speed = true},
    {.name = "motor_speed_rad_s", .gear = 1.0, .is_speed = true, .is_of_motor = true},
});

/// Null for another channel.
[[nodiscard]] constexpr const MotionChannel* find_motion_channel(std::string_view name) noexcept {
  for (const MotionChannel& each : kMotionChannels)
    if (each.name == name) return &each;
  return nullptr;
}

}  // namespace torsio
