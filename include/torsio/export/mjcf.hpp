#pragma once

#include <string>

#include "torsio/actuator/data_sheet.hpp"
#include "torsio/files/model_file.hpp"

namespace torsio {

struct MjcfOptions {
  std::string name = "joint";  ///< prefix of all names, an identifier
  DataSheet actuator = {};     ///< inertias, gear, motor and friction; its spring is not used
  /// The spring is the linear fallback of the model, which every MuJoCo computes; false: the model, by `MujocoSprings`.
  bool is_linear = false;
};

/// A joint as a model of MuJoCo (MJCF): gear side and joint on two coaxial hinges, the spring between them as an actuator
/// on the tendon of the deflection, the motor, and sensors of angles, speeds and torque. Comments contain the units and
/// what the file cannot express.
/// @param origin the model's file, for comments
/// @throws UsageError for a name that is not an identifier; Error for a model whose target is not a torque in Nm, that
/// needs a channel that MuJoCo does not have, or whose state cannot be saved; with `is_linear` also for one whose fallback
/// does not rise with the deflection.
[[nodiscard]] std::string mjcf_text(const ModelFile& model, const MjcfOptions& options,
                                    const std::string& origin);

}  // namespace torsio
