#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "torsio/identify/drive/identify_drive.hpp"

namespace torsio {

/// The version of files of identified drives that this release writes and reads.
inline constexpr int kDriveFormatVersion = 1;

/// An identified drive as JSON (docs/use/identify.md#the-file): values, standard errors, errors of the free runs,
/// structures and findings; the load in the form of a load file, the law in that of a drive file. The fits without a
/// group are not in it.
[[nodiscard]] std::string identified_drive_text(const DriveIdentification& identified);

/// Writes that text completely or not at all. @throws Error if the file cannot be written.
void save_identified_drive(const std::filesystem::path& path,
                           const DriveIdentification& identified);

/// What `torsio identify -o` and `save_identified_drive` wrote; other keys of the document are passed over.
/// @throws Error naming the entry: not JSON, another version, an entry that is missing or of another kind, an unknown
/// parameter or term, a value that the equations cannot have, a load or a law that their files could not state.
[[nodiscard]] DriveIdentification read_identified_drive(const std::filesystem::path& path);
/// @param name for messages, and as the place to which the path of a URDF is relative
[[nodiscard]] DriveIdentification parse_identified_drive(std::string_view text,
                                                         const std::string& name);

}  // namespace torsio
