#include "data/arrays/array_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

std::string list_of(const std::vector<NamedArray>& arrays) {
  constexpr std::size_t kMaxListed = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(arrays.size(), kMaxListed); ++i)
    text += fmt::format("{}{} ({})", i == 0 ? "" : ", ", printable(arrays[i].name),
                        arrays[i].values.size());
  if (arrays.size() > kMaxListed) text += fmt::format(" and {} more", arrays.size() - kMaxListed);
  return text.empty() ? "none" : text;
}

/// The one length of the arrays that are needed.
std::size_t length_of(const std::vector<NamedArray>& arrays, const std::string& file,
                      const std::vector<std::string>& wanted) {
  std::size_t length = 0;
  for (const NamedArray& array : arrays) {
    const bool is_needed = wanted.empty() ? array.values.size() > 1
                                          : std::ranges::find(wanted, array.name) != wanted.end();
    if (!is_needed) continue;
    if (length != 0 && array.values.size() != length)
      throw Error({.place = file,
                   .expected = "arrays of one length",
                   .found = "the arrays (with their lengths) " + list_of(arrays),
                   .advice = wanted.empty() ? "Name those of one clock in a mapping." : ""});
    length = array.values.size();
  }
  if (length == 0)
    throw Error({.place = file,
                 .problem = "no array of numbers that is needed",
                 .expected = wanted.empty() ? "" : joined(wanted),
                 .found = "the arrays (with their lengths) " + list_of(arrays)});
  return length;
}

}  // namespace

LogTable table_of_arrays(std::vector<NamedArray> arrays, const std::string& file,
                         const std::vector<std::string>& wanted) {
  for (const std::string& name : wanted)
    if (std::ranges::find(arrays, name, &NamedArray::name) == arrays.end()) {
      std::vector<std::string> names;
      names.reserve(arrays.size());
      for (const NamedArray& array : arrays) names.push_back(array.name);
      throw Error({.place = file,
                   .problem = fmt::format("there is no array '{}'", printable(name)),
                   .found = "the arrays (with their lengths) " + list_of(arrays),
                   .advice = did_you_mean(name, names)});
    }
  const std::size_t length = length_of(arrays, file, wanted);
  LogTable table;
  table.source.file = file;
  table.row_word = "row";
  table.has_units = false;
  table.line_marks.emplace_back(0, 1);
  for (NamedArray& array : arrays) {
    if (array.values.size() != length) continue;
    if (!wanted.empty() && std::ranges::find(wanted, array.name) == wanted.end() &&
        !split_channel_name(array.name))
      continue;
    table.columns.push_back({.name = std::move(array.name),
                             .number = table.columns.size() + 1,
                             .values = std::move(array.values)});
  }
  return table;
}

}  // namespace torsio
