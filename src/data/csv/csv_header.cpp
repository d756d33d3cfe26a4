#include "data/csv/csv_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/trimmed.hpp"
#include "data/csv/decimal.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

std::string escaped_line(std::string_view line) {
  std::string text;
  for (const char c : line.substr(0, 40))
    text += static_cast<unsigned char>(c) < 0x80
                ? std::string(1, c)
                : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return text;
}

void refuse_latin(std::string_view line, const std::string& place) {
  if (is_utf8(line)) return;
  throw Error({.place = place,
               .expected = "names in UTF-8",
               .found = "other bytes, Latin-1 for example: '" + escaped_line(line) + "'",
               .advice = "Save the file as UTF-8, or convert it:  iconv -f LATIN1 -t UTF-8 LOG.csv "
                         "> LOG_utf8.csv"});
}

void refuse_blanks(const std::vector<std::string>& names, std::string_view line,
                   const std::string& place) {
  if (names.size() > 1 || trimmed(line).find_first_of(" |") == std::string_view::npos) return;
  const bool has_bars = line.find('|') != std::string_view::npos;
  throw Error({.place = place,
               .problem = "no separator found",
               .expected = "names between commas, semicolons or tabs",
               .found = "'" + printable(line) + "'",
               .advice = has_bars
                             ? "Export the log again with one of them, or replace the vertical "
                               "lines:  tr '|' , < LOG.txt > LOG.csv"
                             : "Export the log again with one of them, or put commas in the place "
                               "of the blanks:  sed 's/^ *//; s/  */,/g' LOG.txt > LOG.csv"});
}

/// The time that the serial monitor of Arduino writes before each line: "14:03:10.010 -> ".
void refuse_monitor_times(std::string_view line, const std::string& place) {
  const auto arrow = line.find(" -> ");
  if (arrow == std::string_view::npos || line.find(':') > arrow ||
      line.substr(0, arrow).find_first_not_of("0123456789:.") != std::string_view::npos)
    return;
  throw Error(
      {.place = place,
       .expected = "names of columns",
       .found = "the time of a serial monitor: '" + printable(line.substr(0, arrow + 4)) + "'",
       .advice = "Switch its time stamps off, or remove them:  sed 's/^[0-9:.]* -> //' LOG.txt "
                 "> LOG.csv"});
}

/// Rows without names, some of whose cells are texts.
void refuse_row(const std::vector<std::string>& cells, const std::string& place) {
  const auto numbers = std::ranges::count_if(cells, is_decimal);
  const bool has_decimals = std::ranges::any_of(cells, [](const std::string& cell) {
    return is_decimal(cell) && cell.find('.') != std::string::npos;
  });
  if (2 * numbers <= std::ssize(cells) || !has_decimals) return;  // columns may be named by numbers
  constexpr std::size_t kDigitsOfSeconds = 10;
  const bool is_stamp = cells.size() > 2 && cells[0].size() == kDigitsOfSeconds &&
                        is_decimal(cells[0]) && is_decimal(cells[1]) &&
                        cells[0].find('.') == std::string::npos;
  throw Error(
      {.place = place,
       .expected = "a header line with channel names",
       .found = "a row of numbers: '" + printable(joined(cells)) + "'",
       .advice = is_stamp
                     ? "If it is the output of  ros2 topic echo --csv, record the topic by  ros2 "
                       "bag record  instead, which keeps the names, or put a line with a name "
                       "for each column first, and sum seconds and nanoseconds to one column."
                     : "Put a line with a name for each column first, such as  "
                       "t_s,angle_deg,torque_Nm"});
}

void refuse_open_quote(std::string_view line, const std::string& place) {
  if (std::ranges::count(line, '"') % 2 == 0) return;
  throw Error({.place = place,
               .problem = "a quotation mark is not closed",
               .found = "'" + printable(line) + "'"});
}

void check_names(const std::vector<std::string>& names, const std::string& place) {
  if (std::ranges::all_of(names, is_decimal))
    throw Error({.place = place,
                 .expected = "a header line with channel names",
                 .found = "numbers: '" + printable(joined(names)) + "'",
                 .advice = "Put a line such as  t_s,angle_deg,torque_Nm  first; a header that "
                           "starts with '#' is read if it has as many names."});
  refuse_row(names, place);
  if (std::ranges::all_of(names, [](const auto& name) { return name.empty(); }))
    throw Error({.place = place, .expected = "names of columns", .found = "empty cells"});
}

}  // namespace

bool is_utf8(std::string_view text) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  for (std::size_t i = 0; i < text.size();) {
    const unsigned char first = byte(i++);
    if (first < 0x80) continue;
    if (first < 0xc2 || first > 0xf4) return false;
    const int more = first < 0xe0 ? 1 : first < 0xf0 ? 2 : 3;
    for (int k = 0; k < more; ++k, ++i)
      if (i == text.size() || (byte(i) & 0xc0U) != 0x80U) return false;
  }
  return true;
}

char detect_separator(std::string_view line) {
  constexpr std::array<char, 3> kSeparators = {',', ';', '\t'};
  std::array<std::size_t, 3> count{};
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') quoted = !quoted;
    for (std::size_t i = 0; i < kSeparators.size(); ++i)
      if (!quoted && c == kSeparators.at(i)) ++count.at(i);
  }
  return kSeparators.at(static_cast<std::size_t>(std::ranges::max_element(count) - count.begin()));
}

std::vector<std::string> cells_of(std::string_view line, char separator) {
  std::vector<std::string> cells;
  std::string cell;
  bool quoted = false;
  const auto finish = [&] {
    cells.emplace_back(trimmed(cell));
    cell.clear();
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') {
      const bool escaped = quoted && i + 1 < line.size() && line[i + 1] == '"';
      if (escaped) cell += line[++i];
      if (!escaped) quoted = !quoted;
    } else if (line[i] == separator && !quoted) {
      finish();
    } else {
      cell += line[i];
    }
  }
  finish();
  return cells;
}

void refuse_binary(std::string_view line, const std::string& place) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 && c != '\t'; };
  const auto* const at = std::ranges::find_if(line, is_control);
  if (at == line.end()) return;
  if (line.starts_with("TORSIOB1"))
    throw Error({.place = place,
                 .expected = "a header line of text",
                 .found = "a recorder's sealed blocks",
                 .advice = "Turn them into CSV first: torsio unpack run.tsr -o run.csv"});
  const bool wide = line.starts_with("\xff\xfe") || line.starts_with("\xfe\xff");
  throw Error(
      {.place = place,
       .expected = "a header line of text",
       .found = wide ? "UTF-16" : "binary data: '" + printable(line) + "'",
       .advice = wide ? "Save the file as UTF-8, or convert it:  iconv -f UTF-16 -t UTF-8 LOG.csv "
                        "> LOG_utf8.csv"
                      : "torsio reads CSV, plain or gzipped; convert the file first."});
}

CsvHeader parse_header(std::string_view line, const std::string& place) {
  refuse_binary(line, place);
  CsvHeader header;
  header.separator = detect_separator(line);
  refuse_latin(line, place);
  refuse_monitor_times(line, place);
  refuse_open_quote(line, place);
  header.names = cells_of(line, header.separator);
  refuse_blanks(header.names, line, place);
  check_names(header.names, place);
  return header;
}

}  // namespace torsio
