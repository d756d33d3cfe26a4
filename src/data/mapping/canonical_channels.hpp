#pragma once

#include <array>
#include <string_view>

namespace torsio {

/// What every log of a joint has if it has its sources (specification 0).
struct CanonicalChannel {
  std::string_view name;
  std::string_view expression;
};

// In the order of need: a later one may use an earlier one.
inline constexpr auto kCanonicalChannels = std::to_array<CanonicalChannel>({
    {"spring_deflection_rad", "gear_angle_rad - joint_angle_rad"},
    {"spring_deflection_rate_rad_s", "rate(spring_deflection_rad)"},
    {"joint_speed_rad_s", "rate(joint_angle_rad)"},
    {"motor_speed_rad_s", "rate(motor_angle_rad)"},
});

}  // namespace torsio
