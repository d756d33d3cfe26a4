#include "data/names.hpp"

#include <fmt/format.h>

#include "data/csv/csv_header.hpp"

namespace torsio {

std::string joined(std::span<const std::string> names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string escaped(std::string_view text) {
  const bool is_text = is_utf8(text);
  std::string shown;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || (byte > 0x7f && !is_text))
      shown += fmt::format("\\x{:02x}", byte);
    else
      shown += c;
  }
  return shown;
}

std::string printable(std::string_view text) {
  constexpr std::size_t kShown = 40;
  if (text.size() <= kShown) return escaped(text);
  std::size_t end = kShown;  // not inside a character
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U) --end;
  return escaped(text.substr(0, end)) + "...";
}

std::string file_stem(std::string_view path) {
  if (path == "-") return "stdin";
  if (path.ends_with('/')) path.remove_suffix(1);  // a folder
  std::string_view stem = path.substr(path.find_last_of('/') + 1);
  for (const std::string_view ending :
       {".gz", ".csv", ".tsr", ".mcap", ".npz", ".mat", ".bag", ".db3", ".yaml", ".yml"})
    if (stem.size() > ending.size() && stem.ends_with(ending)) stem.remove_suffix(ending.size());
  return std::string(stem);
}

}  // namespace torsio
