#include "data/mapping/columns_without_unit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxEntries = 12;  ///< lines of a proposed mapping
constexpr std::size_t kMaxDropped = 8;   ///< columns that are dropped one by one

std::string common_start(const std::vector<std::string>& names) {
  std::string start = names.front();
  for (const std::string& name : names)
    while (!name.starts_with(start)) start.pop_back();
  return start;
}

/// The columns for `drop:`, or one pattern that no other column has.
std::string dropped(const std::vector<std::string>& names, const std::vector<std::string>& sound) {
  const std::string pattern = common_start(names) + "*";
  if (names.size() > kMaxDropped && pattern.size() > 1 &&
      std::ranges::none_of(sound, [&](const auto& name) { return is_matched(name, pattern); }))
    return yaml_name(pattern);
  std::vector<std::string> quoted;
  quoted.reserve(names.size());
  for (const std::string& name : names) quoted.push_back(yaml_name(name));
  return joined(quoted);
}

std::string known_units_line() {
  return "\n  Units that a name may end in, also in brackets or in a row below the header: " +
         known_unit_list();
}

std::string line_on_drafts(const LogTable& table) { return "\n  " + advice_on_drafts(table); }

[[noreturn]] void refuse_one(const LogTable& table, const LogColumn& column) {
  const auto ending = column.name.rfind('_');
  const bool has_ending = ending != std::string::npos && ending + 1 < column.name.size();
  throw Error(
      {.place = table.header_place(column),
       .problem = has_ending
                      ? fmt::format("'{}' is not a known unit",
                                    printable(std::string_view(column.name).substr(ending + 1)))
                      : "the name has no unit",
       .advice = advice_without_unit(column.name) + line_on_drafts(table) + known_units_line()});
}

[[noreturn]] void refuse_several(const LogTable& table, const std::vector<std::string>& names,
                                 const std::vector<std::string>& sound) {
  std::vector<std::string> shown;
  shown.reserve(names.size());
  for (const std::string& name : names) shown.push_back(printable(name));
  std::string advice =
      "Write in a mapping what they are, with the units of your log:\n    channels:";
  for (const std::string& name : std::span(names).first(std::min(names.size(), kMaxEntries)))
    advice += "\n      " + mapping_entry(name);
  if (names.size() > kMaxEntries)
    advice += fmt::format("\n      ... and {} more", names.size() - kMaxEntries);
  advice += line_on_drafts(table) +
            fmt::format(
                "\n  With channels: only the ones that it names are read; without it, leave "
                "them out:  drop: [{}]",
                dropped(names, sound)) +
            known_units_line();
  throw Error({.place = table.header_place(),
               .problem = fmt::format("{} columns have no unit: {}", names.size(),
                                      listed(shown, kMaxEntries)),
               .advice = advice});
}

}  // namespace

std::string advice_on_drafts(const LogTable& table) {
  return fmt::format("A draft of a mapping from names and values:  torsio map {} -o mapping.yaml",
                     table.source.file);
}

void refuse_columns_without_unit(const LogTable& table, const std::set<const LogColumn*>& used) {
  std::vector<std::string> names;
  std::vector<std::string> sound;
  std::vector<const LogColumn*> without;
  for (const LogColumn& column : table.columns) {
    if (column.has_unit() || column.time != TimeKind::none || used.contains(&column)) {
      sound.push_back(column.name);
      continue;
    }
    without.push_back(&column);
    names.push_back(column.name);
  }
  if (without.size() == 1) refuse_one(table, *without.front());
  if (!names.empty()) refuse_several(table, names, sound);
}

}  // namespace torsio
