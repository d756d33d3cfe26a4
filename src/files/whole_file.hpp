#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace torsio {

/// The bytes of a regular file.
/// @throws Error if it cannot be read, is not a regular file, or is larger than `max_bytes`: memory
/// is allocated after its size is known.
[[nodiscard]] std::vector<std::byte> read_whole_file(const std::filesystem::path& path,
                                                     std::size_t max_bytes);

/// Writes a regular file completely or not at all (`OutputFile`).
/// @throws Error (disk full, no such folder, no permission, the target is not a regular file); the
/// target is then untouched.
void write_whole_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace torsio
