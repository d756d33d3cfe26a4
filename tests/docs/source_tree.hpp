#pragma once

#include <filesystem>

namespace torsio::test {

/// The root of the sources, which these tests read.
inline const std::filesystem::path kRoot = TORSIO_SOURCE;

}  // namespace torsio::test
