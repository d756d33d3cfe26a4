#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "torsio/core/progress.hpp"

namespace torsio {

/// Bytes in order, from wherever they come.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Up to `size` bytes into `out`; 0 only at the end. @throws Error if reading fails.
  virtual std::size_t read(char* out, std::size_t size) = 0;
  /// SHA-256 (hex) of the bytes of the file before unpacking; call at the end.
  virtual std::string sha256() = 0;
  /// Bytes of the file that were read, before unpacking.
  [[nodiscard]] virtual std::uint64_t bytes_read() const noexcept = 0;
};

/// The first bytes of what zstd packed.
inline constexpr std::string_view kZstdMark{"\x28\xb5\x2f\xfd", 4};

/// A file or pipe by path, "-" for standard input; unpacked if it starts like gzip or zstd. The progress is
/// called with each block and whenever a signal interrupts the wait for one.
[[nodiscard]] std::unique_ptr<ByteSource> open_bytes(const std::string& path,
                                                     const Progress& progress = {});

/// SHA-256 (hex) of bytes in memory.
[[nodiscard]] std::string sha256_hex(std::string_view bytes);
/// The SHA-256 that a recording of this file has. @throws Error if it cannot be read; Cancelled.
[[nodiscard]] std::string sha256_of_file(const std::string& path, const Progress& progress = {});

/// `size` bytes into `to`, or what is left; memory grows with what arrives, whatever the size.
/// @returns whether there were so many
[[nodiscard]] bool read_exactly(ByteSource& source, std::string& to, std::size_t size);

/// Bytes in memory, unpacked if they start like gzip or zstd. `bytes` must outlive the source.
[[nodiscard]] std::unique_ptr<ByteSource> bytes_in_memory(std::string_view bytes,
                                                          const std::string& name);

}  // namespace torsio
