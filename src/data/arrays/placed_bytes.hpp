#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace torsio {

/// Bytes of a file in any order.
class PlacedBytes {
 public:
  virtual ~PlacedBytes() = default;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// What there is of these bytes. @throws Error if reading fails.
  [[nodiscard]] virtual std::string at(std::uint64_t start, std::uint64_t size) const = 0;
};

/// `bytes` must outlive it.
[[nodiscard]] std::unique_ptr<PlacedBytes> placed_bytes(std::string_view bytes);
/// A file that is neither a pipe nor packed. @throws Error if it cannot be opened.
[[nodiscard]] std::unique_ptr<PlacedBytes> placed_bytes_of(const std::string& path);

}  // namespace torsio
