#pragma once

#include <filesystem>
#include <string>

namespace torsio {

/// A path as a study keeps it, for workers in other folders: absolute, unless there is no such file.
[[nodiscard]] inline std::string stored_path(const std::string& path) {
  // A mapping that comes with torsio has a name, not a path.
  return path.empty() || !std::filesystem::exists(path)
             ? path
             : std::filesystem::absolute(path).lexically_normal().string();
}

}  // namespace torsio
