#pragma once

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace torsio::test {

/// Empty if there is no such file.
inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace torsio::test
