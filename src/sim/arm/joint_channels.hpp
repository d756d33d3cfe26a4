#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace torsio {

/// The name of a joint as the beginning of a channel's: `joint1_` of `joint1_motor_angle_rad`.
[[nodiscard]] inline std::string joint_prefix(std::string name) {
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name + "_";
}

}  // namespace torsio
