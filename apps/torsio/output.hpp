#pragma once

#include <initializer_list>
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

/// Refuses an output that cannot be written before any work is done: its folder is missing or not
/// writable, or it is a folder itself.
void require_writable(const std::string& path);
/// The same for a model file, which is written whole or not at all: no device, no standard output.
/// An empty path is none.
void require_model_file(const std::string& path);
/// Refuses a file whose ending promises another format than what is written; a name without an ending
/// is taken.
void require_ending(const char* option, const std::string& path,
                    std::initializer_list<std::string_view> endings);
/// Writes a text file whole or not at all; a device or pipe is written straight.
void write_text(const std::string& path, std::string_view text);
/// Prints to stdout; a full disk or a closed pipe is an Error.
void print(std::string_view text);
/// Prints a remark to stderr.
void remark(std::string_view text);
