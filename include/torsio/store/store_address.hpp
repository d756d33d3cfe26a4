#pragma once

#include <string>
#include <string_view>

namespace torsio {

/// Where a store of studies is.
struct StoreAddress {
  enum class Kind { memory, sqlite, postgresql };
  Kind kind = Kind::memory;
  std::string target;  ///< path of the file, or URL with the password

  /// For messages: the path, or the URL without the password.
  [[nodiscard]] std::string name() const;
};

/// Reads `--store`: the path of a SQLite file, or a URL postgresql://user:password@host:port/name.
/// @throws UsageError for a URL of another kind.
[[nodiscard]] StoreAddress store_address(std::string_view text);

}  // namespace torsio
