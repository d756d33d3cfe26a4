#pragma once

#include <vector>

#include "identify/drive/drive_rollout.hpp"
#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The identified drive through a part of a log, from its commands alone.
struct FreeRun {
  std::vector<double> angle_rad;  ///< angle of the encoder that the log has
  std::vector<double> joint_angle_rad;
  std::vector<double> joint_torque_Nm;
};
[[nodiscard]] FreeRun free_run(const DriveLog& log, const DriveRun& run,
                               const DriveIdentification& identified);
/// Through the whole log, from its own start.
[[nodiscard]] FreeRun free_run(const DriveLog& log, const DriveIdentification& identified);

}  // namespace torsio
