#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// Programs for which an identified drive is written.
enum class DriveTarget : std::uint8_t { bam, mjcf, isaaclab };

[[nodiscard]] std::string_view name(DriveTarget target);
/// @throws UsageError that lists the targets.
[[nodiscard]] DriveTarget drive_target(std::string_view text);

/// An identified drive in another program's equations, refitted with that program's step and integrator: the same
/// parameters would lose accuracy there.
struct WrittenDrive {
  std::string text;  ///< content of the file
  double mae_rad =
      0.0;  ///< error of its free runs through the recordings, in the target's equations
  double own_mae_rad = 0.0;  ///< the same in torsio's equations
  std::string model;         ///< BAM: the friction model, m1 to m6, with the least held-out error
  std::vector<std::string>
      not_expressed;  ///< terms of the identified drive that the target does not have
};

/// What `write_drive` asks of a drive, before one is identified.
/// @param name of the actuator in the file
/// @throws UsageError if the target has no drive of this law: BAM has position servos only; or if the name is not of
/// letters, digits and underscores.
void require_writable(DriveTarget target, DriveLaw law, const std::string& name);

/// @param recordings those of `identified`, in their order
/// @param name of the actuator in the file
/// @throws UsageError as `require_writable`, or for other recordings.
[[nodiscard]] WrittenDrive write_drive(DriveTarget target, const DriveIdentification& identified,
                                       const std::vector<Recording>& recordings,
                                       const std::string& name,
                                       const IdentifyOptions& options = {});

/// BAM's friction models, fitted to the same recordings by the same search: free runs of the held-out groups.
struct BamComparison {
  std::string model;
  double mae_rad = 0.0;
  double held_out_mae_rad = 0.0;
};
[[nodiscard]] std::vector<BamComparison> compare_with_bam(const DriveIdentification& identified,
                                                          const std::vector<Recording>& recordings,
                                                          const IdentifyOptions& options = {});

}  // namespace torsio
