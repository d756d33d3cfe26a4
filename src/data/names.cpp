#include "data/names.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "data/csv/csv_header.hpp"

namespace torsio {

std::string joined(std::span<const std::string> names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string listed(std::span<const std::string> names, std::size_t most) {
  if (names.size() <= most) return joined(names);
  return fmt::format("{} and {} more", joined(names.first(most)), names.size() - most);
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

bool is_matched(std::string_view name, std::string_view pattern) noexcept {
  if (name == pattern) return true;
  std::size_t star = pattern.find('*');
  if (star == std::string_view::npos || !name.starts_with(pattern.substr(0, star))) return false;
  name.remove_prefix(star);
  // Each text between stars is taken where it is first found, the last one at the end.
  for (pattern.remove_prefix(star + 1); (star = pattern.find('*')) != std::string_view::npos;
       pattern.remove_prefix(star + 1)) {
    const std::size_t at = name.find(pattern.substr(0, star));
    if (at == std::string_view::npos) return false;
    name.remove_prefix(at + star);
  }
  return name.ends_with(pattern);
}

bool is_matched_by_any(std::string_view name, std::span<const std::string> patterns) noexcept {
  return std::ranges::any_of(patterns,
                             [&](const auto& pattern) { return is_matched(name, pattern); });
}

std::string file_stem(std::string_view path) {
  if (path == "-") return "stdin";
  if (path.ends_with('/')) path.remove_suffix(1);  // a folder
  std::string_view stem = path.substr(path.find_last_of('/') + 1);
  for (const std::string_view ending : {".gz", ".zst", ".zstd", ".csv", ".tsr", ".mcap", ".npz",
                                        ".mat", ".bag", ".db3", ".json", ".yaml", ".yml"})
    if (stem.size() > ending.size() && stem.ends_with(ending)) stem.remove_suffix(ending.size());
  return std::string(stem);
}

}  // namespace torsio
