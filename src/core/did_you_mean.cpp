#include "core/did_you_mean.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <vector>

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

struct Renamed {
  std::string_view before;
  std::string_view now;
};

// Names of families, options, faults and studies that older files and notes contain.
constexpr std::array kRenamed{
    Renamed{"friction_drive", "rigid_drive"}, Renamed{"clusters", "inducing_points"},
    Renamed{"points", "inducing_points"},     Renamed{"flip", "sign_flip"},
    Renamed{"coarse", "quantised"},           Renamed{"silent", "dropout"},
    Renamed{"003-ladder", "003-models"},
};

// Verbs of other programs.
constexpr std::array kElsewhere{
    Renamed{"train", "fit"},      Renamed{"learn", "fit"},         Renamed{"calibrate", "fit"},
    Renamed{"score", "evaluate"}, Renamed{"test", "evaluate"},     Renamed{"info", "evaluate"},
    Renamed{"show", "evaluate"},  Renamed{"predict", "estimate"},  Renamed{"cv", "crossvalidate"},
    Renamed{"validate", "check"}, Renamed{"inspect", "check"},     Renamed{"tune", "tune-loop"},
    Renamed{"sysid", "identify"}, Renamed{"explain", "attribute"}, Renamed{"benchmark", "bench"},
};

}  // namespace

std::string did_you_mean(std::string_view wrong, std::span<const std::string_view> names) {
  constexpr std::size_t kLongest = 200;
  if (wrong.size() > kLongest) return {};
  for (const auto& [before, now] : kRenamed)
    if (wrong == before && std::ranges::find(names, now) != names.end())
      return "It is now called '" + std::string(now) + "'.";
  for (const auto& [elsewhere, here] : kElsewhere)
    if (wrong == elsewhere && std::ranges::find(names, here) != names.end())
      return "Did you mean '" + std::string(here) + "'?";
  const std::string_view* nearest = nullptr;
  std::size_t distance = kLongest;
  for (const std::string_view& name : names) {
    const std::size_t to_name = edit_distance(wrong, name);
    if (to_name < distance && 3 * to_name <= std::max(name.size(), std::size_t{3})) {
      nearest = &name;
      distance = to_name;
    }
  }
  return nearest == nullptr ? std::string{} : "Did you mean '" + std::string(*nearest) + "'?";
}

std::string did_you_mean(std::string_view wrong, std::span<const std::string> names) {
  const std::vector<std::string_view> views(names.begin(), names.end());
  return did_you_mean(wrong, views);
}

}  // namespace torsio
