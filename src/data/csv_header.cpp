#include "data/csv_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "core/trimmed.hpp"
#include "data/decimal.hpp"
#include "data/names.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

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

std::vector<std::string> split_names(std::string_view line, char separator,
                                     const std::string& place) {
  std::vector<std::string> names;
  std::string name;
  bool quoted = false;
  const auto finish = [&] {
    names.emplace_back(trimmed(name));
    name.clear();
  };
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') {
      const bool escaped = quoted && i + 1 < line.size() && line[i + 1] == '"';
      if (escaped) name += line[++i];
      if (!escaped) quoted = !quoted;
    } else if (line[i] == separator && !quoted) {
      finish();
    } else {
      name += line[i];
    }
  }
  finish();
  if (quoted)
    throw Error({.place = place,
                 .problem = "a quotation mark is not closed",
                 .found = "'" + printable(line) + "'"});
  return names;
}

bool is_number(const std::string& text) {
  const char* at = text.c_str();
  double value = 0.0;
  return read_decimal(at, value) && at == text.c_str() + text.size();
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
  throw Error({.place = place,
               .expected = "a header line of text",
               .found = wide ? "UTF-16" : "binary data: '" + printable(line) + "'",
               .advice = wide ? "Save the file as UTF-8."
                              : "torsio reads CSV, plain or gzipped; convert the file first."});
}

void check_names(const std::vector<std::string>& names, const std::string& place) {
  if (std::ranges::all_of(names, is_number))
    throw Error({.place = place,
                 .expected = "a header line with channel names",
                 .found = "numbers: '" + printable(joined(names)) + "'",
                 .advice = "Put a line such as  t_s,angle_deg,torque_Nm  first; a header that "
                           "starts with '#' is taken for a comment."});
  std::map<std::string_view, std::size_t> seen;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i].empty())
      throw Error({.place = fmt::format("{}, column {}", place, i + 1),
                   .problem = "the column has no name",
                   .advice = "Name it, or remove a separator at the end of the lines."});
    const auto [first, is_new] = seen.emplace(names[i], i + 1);
    if (!is_new)
      throw Error(
          {.place = fmt::format("{}, column {} ({})", place, i + 1, printable(names[i])),
           .problem = fmt::format("duplicate column: column {} has the same name", first->second),
           .advice = "Rename one of them in the file."});
  }
}

}  // namespace

CsvHeader parse_header(std::string_view line, const std::string& place) {
  refuse_binary(line, place);
  CsvHeader header;
  header.separator = detect_separator(line);
  header.names = split_names(line, header.separator, place);
  check_names(header.names, place);
  return header;
}

}  // namespace torsio
