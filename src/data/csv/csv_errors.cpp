#include "data/csv/csv_errors.hpp"

#include <fmt/format.h>

#include "data/csv/decimal.hpp"
#include "data/csv/time_stamp.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

constexpr const char* kAdviceOnCommas =
    "If the numbers have decimal commas, export the log again with semicolons between the cells; "
    "otherwise correct the line.";

std::string advice_on_cell(std::string_view cell, std::string_view column) {
  if (is_like_time(cell))
    return fmt::format(
        "If these are time stamps, write their format in a mapping, with %d before %m if the day "
        "is first:  clock: {{format: {}}}",
        yaml_name(likely_time_format(cell)));
  if (is_decimal_with_comma(cell)) return kAdviceOnCommas;
  return fmt::format(
      "If that is what is written where nothing was measured, write in a mapping  missing: "
      "[{}]\n  A column of texts is left out by  drop: [{}]",
      yaml_name(cell), yaml_name(column));
}

}  // namespace

void refuse_cell(std::string_view cell, const std::string& place, std::string_view column) {
  throw Error({.place = place,
               .expected = "a number, nan or nothing",
               .found = "'" + printable(cell) + "'",
               .advice = advice_on_cell(cell, column)});
}

void refuse_mixture(const std::string& place) {
  throw Error({.place = place,
               .problem = "decimal commas and decimal points in one file",
               .advice = "Export the log again with one of them and without thousands marks."});
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
