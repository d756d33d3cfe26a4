#include "data/names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace torsio {
namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string joined(std::span<const std::string> names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string did_you_mean(std::string_view wrong, std::span<const std::string> names) {
  constexpr std::size_t kLongest = 200;
  if (wrong.size() > kLongest) return {};
  const std::string* nearest = nullptr;
  std::size_t distance = kLongest;
  for (const std::string& name : names) {
    const std::size_t to_name = edit_distance(wrong, name);
    if (to_name < distance && 3 * to_name <= std::max(name.size(), std::size_t{3})) {
      nearest = &name;
      distance = to_name;
    }
  }
  return nearest == nullptr ? std::string{} : fmt::format("Did you mean '{}'?", *nearest);
}

std::string printable(std::string_view text) {
  constexpr std::size_t kShown = 40;
  std::string shown;
  for (const char c : text.substr(0, kShown)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f)
      shown += fmt::format("\\x{:02x}", byte);
    else
      shown += c;
  }
  return text.size() > kShown ? shown + "..." : shown;
}

std::string file_stem(std::string_view path) {
  if (path == "-") return "stdin";
  std::string_view stem = path.substr(path.find_last_of('/') + 1);
  for (const std::string_view ending : {".gz", ".csv", ".yaml", ".yml"})
    if (stem.size() > ending.size() && stem.ends_with(ending)) stem.remove_suffix(ending.size());
  return std::string(stem);
}

}  // namespace torsio
