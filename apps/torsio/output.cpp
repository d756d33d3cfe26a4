#include "output.hpp"

#include <cstdio>
#include <filesystem>
#include <span>

#include "torsio/core/error.hpp"
#include "torsio/files/output_file.hpp"

bool is_standard_output(std::string_view path) { return path == "-" || path == "/dev/stdout"; }

void print(std::string_view text) {
  const std::size_t written = std::fwrite(text.data(), 1, text.size(), stdout);
  if (written != text.size() || std::fflush(stdout) != 0)
    throw torsio::Error({.place = "standard output", .problem = "could not be written to the end"});
}

void remark(std::string_view text) {
  std::fprintf(stderr, "%.*s\n", static_cast<int>(text.size()), text.data());
}

void JsonOutput::write(std::string_view document) const {
  if (destination.empty()) return;
  write_text(destination, document);
}

void require_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder))
    throw torsio::UsageError({.place = path, .problem = "there is no folder " + folder.string()});
}

void write_text(const std::string& path, std::string_view text) {
  if (is_standard_output(path)) return print(text);
  torsio::OutputFile file(path);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}
