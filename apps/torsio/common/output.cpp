#include "common/output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <span>
#include <system_error>

#include "files/output_file.hpp"
#include "torsio/core/error.hpp"

bool is_standard_output(std::string_view path) { return path == "-" || path == "/dev/stdout"; }

void print(std::string_view text) {
  const std::size_t written = std::fwrite(text.data(), 1, text.size(), stdout);
  if (written != text.size() || std::fflush(stdout) != 0)
    throw torsio::Error({.place = "standard output", .problem = "could not be written completely"});
}

void remark(std::string_view text) {
  std::fprintf(stderr, "%.*s\n", static_cast<int>(text.size()), text.data());
}

void remark_note(std::string_view note) {
  remark(note.starts_with("warning: ") ? std::string(note) : "note: " + std::string(note));
}

void JsonOutput::add(CLI::App& verb, std::string_view what) {
  verb.add_option("--json", destination,
                  fmt::format("write {} as JSON to a file, or - for standard output", what));
}

void JsonOutput::write(std::string_view document) const {
  if (destination.empty()) return;
  write_text(destination, document);
}

void make_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    throw torsio::Error(
        {.place = folder, .problem = "the folder cannot be made: " + error.message()});
}

void require_writable(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code absent;
  // A link is followed, as the writing does.
  const fs::path target = torsio::OutputFile::target_of(path);
  const fs::path folder = target.parent_path();
  if (!folder.empty() && !fs::is_directory(folder, absent))
    throw torsio::UsageError({.place = path, .problem = "there is no folder " + folder.string()});
  if (fs::is_directory(target, absent))
    throw torsio::UsageError({.place = path,
                              .expected = "a file to write",
                              .found = "a folder",
                              .advice = "Add the name of the file in this folder."});
  const bool is_replaced = !fs::exists(path, absent) || fs::is_regular_file(path, absent);
  const std::string written = !is_replaced ? path : folder.empty() ? "." : folder.string();
  if (!is_standard_output(path) && ::access(written.c_str(), W_OK) != 0)
    throw torsio::UsageError({.place = path, .problem = "no permission to write to " + written});
  if (torsio::OutputFile::is_protected(target))
    throw torsio::UsageError(
        {.place = path,
         .problem = "the file is read-only",
         .advice = "Give the output another name, or allow writing: chmod u+w."});
}

void require_model_file(const std::string& path) {
  if (path.empty()) return;
  std::error_code absent;
  const bool is_device =
      std::filesystem::exists(path, absent) && !std::filesystem::is_regular_file(path, absent);
  if (!is_standard_output(path) && !is_device) return;
  throw torsio::UsageError({.place = path,
                            .expected = "a file to write the model to",
                            .found = "a device, pipe or standard output",
                            .advice = "A model is written completely or not at all: name a file."});
}

void require_ending(const char* option, const std::string& path,
                    std::initializer_list<std::string_view> endings) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending.empty() || std::ranges::find(endings, ending) != endings.end()) return;
  throw torsio::UsageError(
      {.place = option,
       .expected = fmt::format("a file that ends in {}", fmt::join(endings, " or ")),
       .found = path});
}

void write_text(const std::string& path, std::string_view text) {
  if (is_standard_output(path)) return print(text);
  torsio::OutputFile file(path);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}
