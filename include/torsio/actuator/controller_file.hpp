#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "torsio/control/joint_controller.hpp"
#include "torsio/control/joint_stop.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// The controller of one joint: what `JointController` and `JointStop` take, and for which actuator.
struct ControllerFile {
  std::string actuator;  ///< for messages and comments
  double sample_rate_Hz = 0.0;
  JointControllerCore::Settings settings = {};  ///< `settings.gains`: none, from the bandwidth
  std::optional<JointStop::Settings> stop = std::nullopt;  ///< with the drive of `settings`
};

/// As YAML, with a unit in the name of each number; docs/robot/control.md has the format.
/// `parse_controller` of it gives the same settings.
[[nodiscard]] std::string controller_yaml(const ControllerFile& controller);

/// @throws UsageError naming file, line, what was expected and found, for a key that is missing or not known, or a number
/// that is none; Error of `JointController` and `JointStop` for settings with which they refuse to work; Cancelled.
[[nodiscard]] ControllerFile read_controller(const std::string& path,
                                             const Progress& progress = {});
/// The same from a text. @param file for messages
[[nodiscard]] ControllerFile parse_controller(std::string_view text, const std::string& file);

}  // namespace torsio
