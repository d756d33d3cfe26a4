#include "data/arrays/array_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "data/names.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {
namespace {

std::string list_of(const ReadArrays& read) {
  constexpr std::size_t kMaxListed = 20;
  const std::vector<NamedArray>& arrays = read.arrays;
  std::string text = "the arrays (with their lengths) ";
  for (std::size_t i = 0; i < std::min(arrays.size(), kMaxListed); ++i)
    text += fmt::format("{}{} ({})", i == 0 ? "" : ", ", arrays[i].name, arrays[i].values.size());
  if (arrays.size() > kMaxListed) text += fmt::format(" and {} more", arrays.size() - kMaxListed);
  if (arrays.empty()) text = "no arrays of numbers";
  if (!read.not_read.empty()) text += "; not read: " + listed(read.not_read);
  return text;
}

/// The one length of the arrays that are needed.
std::size_t length_of(const ReadArrays& read, const std::string& file,
                      const std::vector<std::string>& wanted) {
  const std::vector<NamedArray>& arrays = read.arrays;
  std::size_t length = 0;
  for (const NamedArray& array : arrays) {
    const bool is_needed = wanted.empty() ? array.values.size() > 1
                                          : std::ranges::find(wanted, array.name) != wanted.end();
    if (!is_needed) continue;
    if (length != 0 && array.values.size() != length)
      throw Error({.place = file,
                   .expected = "arrays of one length",
                   .found = list_of(read),
                   .advice = wanted.empty() ? "Name those of one clock in a mapping." : ""});
    length = array.values.size();
  }
  if (length == 0)
    throw Error({.place = file,
                 .problem = "no array of numbers that is needed",
                 .expected = wanted.empty() ? "" : joined(wanted),
                 .found = list_of(read)});
  return length;
}

}  // namespace

std::optional<MatrixShape> as_matrix(std::span<const std::size_t> dimensions) {
  std::vector<std::size_t> longer(dimensions.begin(), dimensions.end());
  if (dimensions.size() > 2) std::erase(longer, std::size_t{1});
  if (longer.size() > 2) return std::nullopt;
  longer.resize(2, 1);
  const bool is_turned = dimensions.size() > 2 && longer[1] >= longer[0] && longer[1] > 1;
  return MatrixShape{.rows = longer[is_turned ? 1 : 0],
                     .columns = longer[is_turned ? 0 : 1],
                     .is_turned = is_turned};
}

std::string problem_of_shape(std::span<const std::size_t> dimensions) {
  constexpr std::size_t kMaxSignals = 100;
  const auto shape = as_matrix(dimensions);
  if (!shape) return "more than two dimensions";
  if (shape->rows > 1 && shape->columns > std::max(shape->rows, kMaxSignals))
    return fmt::format("{} x {}; the columns of a matrix are the signals: save its transpose",
                       shape->rows, shape->columns);
  return {};
}

namespace {

/// Gives an array of one column the name of its first column, where only that is wanted.
void name_as_wanted(std::vector<NamedArray>& arrays, const std::vector<std::string>& wanted) {
  constexpr std::string_view kFirst = "/0";
  for (const std::string& name : wanted) {
    if (!name.ends_with(kFirst) ||
        std::ranges::find(arrays, name, &NamedArray::name) != arrays.end())
      continue;
    const std::string whole = name.substr(0, name.size() - kFirst.size());
    const auto at = std::ranges::find(arrays, whole, &NamedArray::name);
    if (at == arrays.end()) continue;
    if (std::ranges::find(wanted, whole) == wanted.end()) {
      at->name = name;
    } else {
      NamedArray copy = *at;
      copy.name = name;
      arrays.push_back(std::move(copy));
    }
  }
}

}  // namespace

LogTable table_of_arrays(ReadArrays read, const std::string& file,
                         const std::vector<std::string>& wanted) {
  std::vector<NamedArray>& arrays = read.arrays;
  name_as_wanted(arrays, wanted);
  for (const std::string& name : wanted)
    if (std::ranges::find(arrays, name, &NamedArray::name) == arrays.end()) {
      const std::string whole = name.substr(0, name.find('/'));
      for (const std::string& problem : read.not_read)
        if (problem.starts_with(name + " (") || problem.starts_with(whole + " ("))
          throw Error({.place = file,
                       .problem = "the array is not read: " + problem,
                       .expected = "real numbers in one or two dimensions",
                       .advice = "Save it as such an array, or several."});
      std::vector<std::string> names;
      names.reserve(arrays.size());
      for (const NamedArray& array : arrays) names.push_back(array.name);
      throw Error({.place = file,
                   .problem = fmt::format("there is no array '{}'", escaped(name)),
                   .found = list_of(read),
                   .advice = did_you_mean(name, names)});
    }
  const std::size_t length = length_of(read, file, wanted);
  LogTable table;
  table.source.file = file;
  table.row_word = "row";
  table.has_units = false;
  table.line_marks.emplace_back(0, 1);
  for (NamedArray& array : arrays) {
    if (array.values.size() != length) continue;
    if (!wanted.empty() && std::ranges::find(wanted, array.name) == wanted.end() &&
        !split_channel_name(array.name) && array.time == TimeKind::none)
      continue;
    table.columns.push_back({.name = std::move(array.name),
                             .number = table.columns.size() + 1,
                             .values = std::move(array.values),
                             .time = array.time});
  }
  table.not_read = std::move(read.not_read);
  return table;
}

}  // namespace torsio
