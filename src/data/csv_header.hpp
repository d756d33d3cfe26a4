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

/// @throws Error at `place` if this is no header: numbers, binary data, an empty or repeated name.
[[nodiscard]] CsvHeader parse_header(std::string_view line, const std::string& place);

}  // namespace torsio
