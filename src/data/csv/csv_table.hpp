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

/// What a mapping specifies about a CSV file.
struct CsvRules {
  /// Whether columns without a unit are read only if they are wanted, or hold dates.
  bool only_wanted = false;
  /// For a list of what there is: columns of texts, and of a name that another one has, are left out with the reason
  /// (`LogTable::not_read`), not refused.
  bool leaves_out_texts = false;
  std::vector<std::string> missing = {};  ///< further cells of what was not measured
  /// Columns in which each number is one, also those of `missing`: the clock, what splits the log, masks.
  std::vector<std::string> complete = {};
  std::string decimal = {};      ///< "comma" or "point"; empty: it is found
  std::size_t skip_lines = 0;    ///< lines before the header; 0: it is looked for
  std::string time_format = {};  ///< how dates are written, for strptime; empty: ISO 8601
};

struct CsvOptions {
  std::vector<std::string> skip = {};  ///< columns that are not read and may hold anything
  CsvLimits limits = {};
  Progress progress =
      {};  ///< is called with each block that is read, also while waiting for a pipe
  std::vector<std::string> wanted = {};  ///< columns that the mapping names
  CsvRules rules = {};
};

/// Reads a CSV file, plain or gzipped (detected by its first bytes); "-" is standard input. The
/// header gives the names; separator comma, semicolon or tab; lines that start with '#' are
/// comments. What was assumed is in the notes of the table. See docs/use/recordings.md.
/// @throws Error with line and column if it is not a table of numbers, Cancelled if the
/// progress asks to stop.
[[nodiscard]] LogTable read_csv(const std::string& path, const CsvOptions& options = {});

/// The same from bytes of any origin; `name` is the file name in messages.
[[nodiscard]] LogTable read_csv(ByteSource& source, const std::string& name,
                                const CsvOptions& options = {});
[[nodiscard]] LogTable parse_csv(std::string_view bytes, const std::string& name,
                                 const CsvOptions& options = {});

}  // namespace torsio
