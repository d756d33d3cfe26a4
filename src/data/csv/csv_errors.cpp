#include "data/csv/csv_errors.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "data/csv/time_stamp.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr const char* kAdviceOnCommas =
    "If the numbers have commas, export the log again with semicolons or tabs between the cells, "
    "and write in a mapping  decimal: comma  if decimals follow the commas, or  decimal: point  if "
    "they separate thousands. Otherwise correct the line.";

/// Digits with commas or points at places where they mean nothing, such as 1,23,456.
bool is_like_marked_number(std::string_view cell) {
  return cell.find_first_of("0123456789") != std::string_view::npos &&
         cell.find_first_not_of("+-0123456789.,' ") == std::string_view::npos;
}

std::string advice_on_cell(std::string_view cell, std::string_view column) {
  if (is_like_time(cell))
    return fmt::format(
        "If these are time stamps, write their format in a mapping, with %d before %m if the day "
        "is first:  clock: {{format: {}}}",
        yaml_name(likely_time_format(cell)));
  if (is_like_marked_number(cell))
    return "Export the log again without marks between thousands, or correct the cell.";
  return fmt::format(
      "If that is what is written where nothing was measured, write in a mapping  missing: "
      "[{}]\n  A column of texts is left out by  drop: [{}]\n  If each row belongs to one joint, "
      "which this "
      "column names, write a file for each joint first.",
      yaml_name(cell), yaml_name(column));
}

}  // namespace

std::string csv_place(const std::string& file, std::size_t line, const LogColumn& column) {
  return fmt::format("{}: line {}, column {} ({})", file, line, column.number, column.name);
}

void refuse_cell(std::string_view cell, const std::string& place, std::string_view column) {
  throw Error({.place = place,
               .expected = "a number, nan or nothing",
               .found = "'" + printable(cell) + "'",
               .advice = advice_on_cell(cell, column)});
}

void refuse_mixture(const std::string& place) {
  throw Error({.place = place,
               .problem = "decimal commas and decimal points in one file",
               .advice =
                   "If one of them separates thousands, state the other one in a mapping:  "
                   "decimal: comma  or  decimal: point\n  Otherwise export the log again with "
                   "one of them."});
}

void refuse_other_mark(std::string_view cell, const std::string& place, std::string_view stated) {
  const bool is_comma = stated == "comma";
  throw Error(
      {.place = place,
       .expected = fmt::format("a number with a decimal {0}, as the mapping states (decimal: "
                               "{0}), and {1} between groups of three digits only",
                               stated, is_comma ? "points" : "commas"),
       .found = "'" + printable(cell) + "'",
       .advice = fmt::format("Correct the cell, or write in the mapping  decimal: {}",
                             is_comma ? "point" : "comma")});
}

void refuse_unclear_commas(std::string_view cell, const std::string& place,
                           bool is_only_above_thousand) {
  std::string decimals(cell);
  std::ranges::replace(decimals, ',', '.');
  std::string thousands(cell);
  std::erase(thousands, ',');
  throw Error(
      {.place = place,
       .problem = fmt::format("the comma in '{}' may precede decimals or separate thousands",
                              printable(cell)),
       .expected = "a number that shows which it is, such as 0,5 or 1,234.5",
       .found = is_only_above_thousand
                    ? "commas that three digits follow, and below 1000 numbers without a comma, as "
                      "with thousands marks"
                    : "commas that three digits follow",
       .advice = fmt::format(
           "State it in a mapping:  decimal: point  if it is {}, or  decimal: comma  if it is {}",
           thousands, decimals)});
}

void refuse_cells(const std::string& place, std::size_t found, const HeaderSize& header) {
  throw Error(
      {.place = place,
       .expected = fmt::format("{} cells, as in the header (line {})", header.names, header.line),
       .found = fmt::format("{}", found),
       .advice = header.separator == ',' && found > header.names
                     ? kAdviceOnCommas
                     : "The line may have been cut off while logging: remove or correct it."});
}

}  // namespace torsio
