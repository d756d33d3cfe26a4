#pragma once

#include <CLI/App.hpp>
#include <initializer_list>
#include <string>
#include <string_view>

/// "-" or /dev/stdout.
[[nodiscard]] bool is_standard_output(std::string_view path);

/// Where a verb's machine-readable document is written (`--json FILE|-`) and whether the text
/// tables are printed, too.
struct JsonOutput {
  std::string destination;  ///< empty: none; "-": standard output

  /// @param what the document contains: "the scores"
  void add(CLI::App& verb, std::string_view what);
  /// Text tables are printed to stdout unless the document is.
  [[nodiscard]] bool wants_tables() const { return !is_standard_output(destination); }
  /// @throws torsio::Error if the document cannot be written completely.
  void write(std::string_view document) const;
};

/// Refuses an output that cannot be written before any work is done: its folder is missing or not
/// writable, or it is a folder itself.
void require_writable(const std::string& path);
/// With those above it; one that exists is left as it is. @throws Error
void make_folder(const std::string& folder);
/// The same for a model file, which is written completely or not at all: no device, no standard
/// output. An empty path is none.
void require_model_file(const std::string& path);
/// Refuses a file whose ending belongs to another format than the one that is written; a name
/// without an ending is accepted.
void require_ending(const char* option, const std::string& path,
                    std::initializer_list<std::string_view> endings);
/// Writes a text file completely or not at all; a device or pipe is written directly.
void write_text(const std::string& path, std::string_view text);
/// Prints to stdout; a full disk or a closed pipe is an Error.
void print(std::string_view text);
/// Prints a remark to stderr.
void remark(std::string_view text);
/// Prints a note of a fit to stderr; one that is a warning begins with that word.
void remark_note(std::string_view note);
