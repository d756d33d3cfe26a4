#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

/// The names in a header line and what separates them.
struct CsvHeader {
  char separator = ',';
  std::vector<std::string> names;
};

/// Whether every byte above 127 belongs to a character of UTF-8.
[[nodiscard]] bool is_utf8(std::string_view text) noexcept;

/// @throws Error at `place` if this is not a header: numbers, binary data, an empty or repeated
/// name.
[[nodiscard]] CsvHeader parse_header(std::string_view line, const std::string& place);

}  // namespace torsio
