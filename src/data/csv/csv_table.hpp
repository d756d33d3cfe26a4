#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "data/byte_source.hpp"
#include "data/log_table.hpp"
#include "torsio/core/progress.hpp"

namespace torsio {

/// What a reader takes before it refuses: a pipe of endless zeros must not fill the memory.
struct CsvLimits {
  std::size_t header_bytes = std::size_t{64} << 10;  ///< the header line must end within these
  std::size_t line_bytes = std::size_t{1} << 20;
  std::size_t gap_bytes = std::size_t{16} << 20;  ///< one stretch of blank lines and comments
  std::size_t values = std::size_t{256} << 20;    ///< cells of numbers: 2 GiB of memory
};

struct CsvOptions {
  std::vector<std::string> skip = {};  ///< columns that are not read and may hold anything
  CsvLimits limits = {};
  Progress progress =
      {};  ///< is called with each block that is read, also while waiting for a pipe
};

/// Reads a CSV file, plain or gzipped (detected by its first bytes); "-" is standard input. The
/// header gives the names; separator comma, semicolon or tab; lines that start with '#' are
/// comments. See docs/use/recordings.md.
/// @throws Error with line and column if it is not a table of numbers, Cancelled if the
/// progress asks to stop.
[[nodiscard]] LogTable read_csv(const std::string& path, const CsvOptions& options = {});

/// The same from bytes of any origin; `name` is the file name in messages.
[[nodiscard]] LogTable read_csv(ByteSource& source, const std::string& name,
                                const CsvOptions& options = {});
[[nodiscard]] LogTable parse_csv(std::string_view bytes, const std::string& name,
                                 const CsvOptions& options = {});

}  // namespace torsio
