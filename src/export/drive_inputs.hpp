#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "torsio/files/model_file.hpp"

namespace torsio {

/// The inputs of a network as simulators give them to a learned actuator: errors of position and speeds, the newest first.
struct DriveInputs {
  std::vector<std::size_t> lags = {};             ///< ticks
  std::vector<std::size_t> position_errors = {};  ///< for each lag the index of the feature
  std::vector<std::size_t> speeds = {};
};

/// The features of a model as `DriveInputs`.
/// @throws UsageError that names a feature that is neither `joint_target_rad - joint_angle_rad` nor
/// `joint_speed_rad_s`, with or without lag(x, n), or lags that differ
[[nodiscard]] DriveInputs drive_inputs(const ModelFile& model, const std::string& place);

}  // namespace torsio
