#pragma once

#include <string>
#include <string_view>

/// "-" or /dev/stdout.
[[nodiscard]] bool is_standard_output(std::string_view path);

/// Where a verb's machine-readable document goes (`--json FILE|-`) and, with it, whether people's
/// tables are printed.
struct JsonOutput {
  std::string destination;  ///< empty: none; "-": standard output

  /// Tables for people go to stdout unless the document does.
  [[nodiscard]] bool wants_tables() const { return !is_standard_output(destination); }
  /// @throws torsio::Error if the document cannot be written whole.
  void write(std::string_view document) const;
};

/// Refuses an output whose folder does not exist before any work is done; an empty path is none.
void require_folder_of(const std::string& path);
/// Writes a text file whole or not at all; a device or pipe is written straight.
void write_text(const std::string& path, std::string_view text);
/// Prints to stdout; a full disk or a closed pipe is an Error.
void print(std::string_view text);
/// Prints a remark to stderr.
void remark(std::string_view text);
