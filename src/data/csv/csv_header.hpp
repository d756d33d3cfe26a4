#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace torsio {

/// The names in a header line and what separates them.
struct CsvHeader {
  char separator = ',';
  std::vector<std::string> names;  ///< empty where a column has none
};

/// Whether every byte above 127 belongs to a character of UTF-8.
[[nodiscard]] bool is_utf8(std::string_view text) noexcept;

/// @throws Error at `place` if this is not a header: numbers, binary data, no names.
[[nodiscard]] CsvHeader parse_header(std::string_view line, const std::string& place);
/// @throws Error at `place` for control characters.
void refuse_binary(std::string_view line, const std::string& place);

/// The separator that is most frequent in a line.
[[nodiscard]] char detect_separator(std::string_view line);
/// The cells of a line without quotes and blanks around them.
[[nodiscard]] std::vector<std::string> cells_of(std::string_view line, char separator);

}  // namespace torsio
