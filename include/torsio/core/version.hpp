#pragma once

namespace torsio {

/// The release, "major.minor.patch"; CMakeLists.txt reads it from here.
inline constexpr const char* kVersion = "0.2.0";

}  // namespace torsio
