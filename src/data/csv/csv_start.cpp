#include "data/csv/csv_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "core/trimmed.hpp"
#include "data/csv/decimal.hpp"
#include "data/csv/missing_mark.hpp"
#include "data/csv/number_marks.hpp"
#include "data/csv/time_stamp.hpp"
#include "data/mapping/column_advice.hpp"
#include "torsio/core/error.hpp"

namespace torsio {
namespace {

/// A model file, whose first bytes are a number and may hold a line end.
void refuse_model(std::string_view first, LineReader& lines, const std::string& name) {
  constexpr std::string_view kMark = R"({"__metadata__")";
  constexpr std::size_t kLengthBytes = 8;
  constexpr std::size_t kLongestHeader = std::size_t{1} << 20;
  const bool is_like_length = first.size() < kLengthBytes && !is_utf8(first);
  std::string_view next = first;
  if (is_like_length && !lines.next(next, kLongestHeader)) return;
  if (next.substr(0, kLengthBytes + kMark.size()).find(kMark) == std::string_view::npos) return;
  throw Error({.place = name,
               .expected = "a recording",
               .found = "a model file",
               .advice = "torsio evaluate MODEL REC takes the model first; other verbs take "
                         "recordings only."});
}

bool is_number_cell(const std::string& cell) {
  double value = 0.0;
  return is_decimal(cell) || MarkedNumber(cell).is_number() || read_hexadecimal(cell, value) ||
         MarkedNumber(usual_spelling(cell)).is_number();
}

/// A line in the cells of its own separator.
struct SplitLine {
  char separator = ',';
  std::vector<std::string> cells;
};

SplitLine split(std::string_view line) {
  const char separator = detect_separator(line);
  return {separator, cells_of(line, separator)};
}

bool has_number(const std::vector<std::string>& cells) {
  return std::ranges::any_of(cells, is_number_cell);
}

/// A row of a table without columns of texts.
bool is_row(const std::vector<std::string>& cells, const CsvRules& rules) {
  bool has_value = false;
  for (const std::string& cell : cells) {
    const bool is_value = is_number_cell(cell) || read_time_stamp(cell) ||
                          (!rules.time_format.empty() && read_time_stamp(cell, rules.time_format));
    has_value = has_value || is_value;
    if (!is_value && !cell.empty() && !is_missing_mark(cell) &&
        std::ranges::find(rules.missing, cell) == rules.missing.end())
      return false;
  }
  return has_value;
}

/// Known units, perhaps with other texts, but without numbers other than 1.
bool is_row_of_units(const std::vector<std::string>& cells) {
  bool has_unit = false;
  for (const std::string& cell : cells) {
    const Unit* const unit = unit_in_words(cell);
    has_unit = has_unit || (unit != nullptr && unit->suffix != "1");
    if (is_number_cell(cell) && cell != "1") return false;
  }
  return has_unit;
}

/// Looks for the header among the first lines.
class HeaderSearch {
 public:
  HeaderSearch(LineReader& lines, const CsvOptions& options, LineAhead first)
      : lines_(lines), options_(options) {
    keep(std::move(first));
  }

  /// Which of `significant` lines is the header; nothing if none is like one.
  [[nodiscard]] std::optional<std::size_t> find(bool with_texts) {
    for (std::size_t i = 0; i < kMaxLines && has(i + 1); ++i)
      if (is_header(i, with_texts)) return i;
    return std::nullopt;
  }
  [[nodiscard]] const LineAhead& line(std::size_t significant) const {
    return all_[significant_[significant]];
  }
  [[nodiscard]] bool has_units(std::size_t header) {
    if (!has(header + 2)) return false;
    const char separator = splits_[header].separator;
    const std::size_t size = splits_[header].cells.size();
    const std::vector<std::string> units = cells(header + 1, separator);
    const std::vector<std::string> row = cells(header + 2, separator);
    return units.size() == size && row.size() == size && is_row_of_units(units) && has_number(row);
  }
  [[nodiscard]] std::vector<std::string> cells(std::size_t significant, char separator) const {
    return cells_of(line(significant).line(), separator);
  }
  /// The lines from that one on.
  [[nodiscard]] std::vector<LineAhead> take_from(std::size_t significant) {
    std::vector<LineAhead> rest;
    for (std::size_t i = significant < significant_.size() ? significant_[significant]
                                                           : all_.size();
         i < all_.size(); ++i)
      rest.push_back(std::move(all_[i]));
    return rest;
  }

 private:
  static constexpr std::size_t kMaxLines = 200;
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 20;

  void keep(LineAhead line) {
    bytes_ += line.text.size();
    if (!is_comment_or_blank(line.line())) {
      significant_.push_back(all_.size());
      splits_.push_back(split(line.line()));
    }
    all_.push_back(std::move(line));
  }

  /// Reads on up to that line.
  [[nodiscard]] bool has(std::size_t significant) {
    std::string_view line;
    while (significant_.size() <= significant) {
      if (bytes_ > kMaxBytes || all_.size() > 2 * kMaxLines ||
          !lines_.next(line, options_.limits.line_bytes))
        return false;
      keep({std::string(line) + '\n', lines_.number()});
    }
    return true;
  }

  [[nodiscard]] bool is_header(std::size_t i, bool with_texts) {
    const SplitLine line = splits_[i];  // a copy, since more lines may be split
    const std::vector<std::string>& names = line.cells;
    const auto is_name = [](const std::string& cell) {
      return !cell.empty() && !is_missing_mark(cell) && !read_time_stamp(cell);
    };
    if (has_number(names) || std::ranges::none_of(names, is_name)) return false;
    std::vector<std::string> next = cells(i + 1, line.separator);
    while (next.size() > names.size() && next.back().empty()) next.pop_back();
    if (next.size() != names.size()) return false;
    if (!with_texts) {
      if (is_row(next, options_.rules)) return true;
      return has_units(i) && is_row(cells(i + 2, line.separator), options_.rules);
    }
    if (names.size() < 2) return false;
    if (has_units(i)) return true;
    if (!has_number(next)) return false;
    if (!has(i + 2)) return true;
    const std::vector<std::string> after = cells(i + 2, line.separator);
    return after.size() >= next.size() && has_number(after);
  }

  LineReader& lines_;
  const CsvOptions& options_;
  std::vector<LineAhead> all_;
  std::vector<std::size_t> significant_;
  std::vector<SplitLine> splits_;  ///< the significant lines
  std::size_t bytes_ = 0;
};

/// The first line that is neither blank nor a comment, and the last comment before it.
LineAhead first_line(LineReader& lines, const std::string& name, const CsvOptions& options,
                     LineAhead& comment) {
  const std::size_t limit = options.limits.header_bytes;
  std::string_view line;
  std::size_t bytes = 0;
  while (lines.next(line, limit)) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (lines.number() == 1 && line.starts_with(kByteOrderMark))
      line.remove_prefix(kByteOrderMark.size());
    const bool is_skipped = lines.number() <= options.rules.skip_lines;
    if (!is_skipped && !is_comment_or_blank(line))
      return {std::string(line) + '\n', lines.number()};
    if (!is_skipped && !line.empty()) comment = {std::string(line) + '\n', lines.number()};
    bytes += line.size() + 1;
    if (bytes > limit)
      throw Error({.place = name,
                   .problem = fmt::format("no header line within the first {} bytes", limit)});
  }
  throw Error({.place = name,
               .problem = lines.number() == 0 ? "the file is empty" : "no header line",
               .expected = "a header line and rows of numbers"});
}

/// The names in a comment above rows of numbers, as numpy.savetxt writes them.
std::optional<CsvHeader> header_in_comment(const LineAhead& comment, std::string_view row) {
  if (comment.text.empty()) return std::nullopt;
  const SplitLine numbers = split(row);
  if (!std::ranges::all_of(numbers.cells, is_number_cell)) return std::nullopt;
  std::string_view text = comment.line();
  text.remove_prefix(std::min(text.find_first_not_of("#,;\t "), text.size()));
  CsvHeader header{.separator = numbers.separator, .names = cells_of(text, numbers.separator)};
  const auto is_name = [](const std::string& cell) {
    return !cell.empty() && !is_number_cell(cell);
  };
  if (header.names.size() != numbers.cells.size() || !std::ranges::all_of(header.names, is_name))
    return std::nullopt;
  return header;
}

}  // namespace

CsvStart read_start(LineReader& lines, const std::string& name, const CsvOptions& options) {
  const auto place_of = [&](std::size_t line) { return fmt::format("{}: line {}", name, line); };
  CsvStart start;
  LineAhead comment;
  LineAhead first = first_line(lines, name, options, comment);
  refuse_model(first.line(), lines, name);
  refuse_binary(first.line(), place_of(first.number));
  if (const auto header = header_in_comment(comment, first.line())) {
    start.header = *header;
    start.line = comment.number;
    start.notes.push_back(
        fmt::format("the comment in line {} is read as the header", comment.number));
    start.ahead.push_back(std::move(first));
    return start;
  }
  HeaderSearch search(lines, options, std::move(first));
  std::size_t header = 0;
  if (options.rules.skip_lines == 0) {
    auto found = search.find(false);
    if (!found) found = search.find(true);
    header = found.value_or(0);
  }
  start.line = search.line(header).number;
  start.header = parse_header(search.line(header).line(), place_of(start.line));
  if (header > 0)
    start.notes.push_back(
        fmt::format("line {} is read as the header; the lines above are skipped", start.line));
  const bool has_units = search.has_units(header);
  if (has_units) {
    start.units = search.cells(header + 1, start.header.separator);
    start.notes.push_back(
        fmt::format("line {} is read as a row of units", search.line(header + 1).number));
  }
  start.ahead = search.take_from(header + (has_units ? 2 : 1));
  return start;
}

}  // namespace torsio
