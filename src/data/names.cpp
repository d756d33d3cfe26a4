#include "data/names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

namespace torsio {
namespace {

/// Letters to insert, remove, change or swap with their neighbour.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);
  std::vector<std::size_t> above(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    before.swap(above);
    above.swap(row);
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] = std::min({above[j] + (a[i] == b[j] ? 0U : 1U), above[j + 1] + 1, row[j] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j])
        row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
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
  for (const std::string_view ending : {".gz", ".csv", ".tsr", ".yaml", ".yml"})
    if (stem.size() > ending.size() && stem.ends_with(ending)) stem.remove_suffix(ending.size());
  return std::string(stem);
}

}  // namespace torsio
