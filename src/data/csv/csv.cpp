#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "data/byte_source.hpp"
#include "data/csv/csv_header.hpp"
#include "data/csv/csv_table.hpp"
#include "data/csv/decimal.hpp"
#include "data/csv/line_reader.hpp"
#include "data/names.hpp"
#include "data/read_budget.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

/// Turns lines into rows of a table.
class TableParser {
 public:
  TableParser(LogTable& table, const CsvHeader& header, const CsvOptions& options,
              ReadBudget& budget)
      : table_(table), separator_(header.separator), limits_(options.limits), budget_(budget) {
    for (std::size_t i = 0; i < header.names.size(); ++i)
      columns_.push_back({.name = header.names[i], .number = i + 1, .values = {}});
    for (const LogColumn& column : columns_)
      read_.push_back(std::ranges::find(options.skip, column.name) == options.skip.end() ? 1 : 0);
  }

  /// `line` must be followed by a '\n' in memory.
  void add(std::string_view line, std::size_t number) {
    const char* at = line.data();
    const char* const end = at + line.size();
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (i > 0) {
        if (at == end) refuse_ragged(line, number);
        ++at;
      }
      double value = kNotMeasured;
      const char* after = at;
      if (read_[i] == 0) {
        at = cell_end(at, end);
        continue;
      }
      if (!read_decimal(after, value) || (after != end && *after != separator_)) {
        after = cell_end(at, end);
        value = unusual_cell({at, after}, number, columns_[i]);
      } else if (comma_seen_ && std::string_view(at, after).find('.') != std::string_view::npos) {
        refuse_mixture(number, columns_[i]);
      }
      columns_[i].values.push_back(value);
      at = after;
    }
    if (at != end) refuse_ragged(line, number);
    mark(number);
    budget_.keep(columns_.size() * sizeof(double));
    if (++rows_ * columns_.size() > limits_.values)
      throw Error({.place = fmt::format("{}: line {}", table_.source.file, number),
                   .problem = fmt::format("more than {} numbers", limits_.values),
                   .advice = "Cut the log into several files."});
  }

  void finish() {
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (read_[i] != 0) table_.columns.push_back(std::move(columns_[i]));
  }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }

 private:
  [[nodiscard]] const char* cell_end(const char* at, const char* end) const {
    bool quoted = false;
    for (; at != end && (quoted || *at != separator_); ++at)
      if (*at == '"') quoted = !quoted;
    return at;
  }

  /// Everything but a plain number: blanks, quotes, an empty cell, nan, a decimal comma.
  double unusual_cell(std::string_view cell, std::size_t line, const LogColumn& column) {
    const std::string_view whole = cell;
    const auto strip = [&cell](char c) {
      while (!cell.empty() && cell.front() == c) cell.remove_prefix(1);
      while (!cell.empty() && cell.back() == c) cell.remove_suffix(1);
    };
    strip(' ');
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
      cell = cell.substr(1, cell.size() - 2);
    strip(' ');
    if (cell.empty() || cell == "nan" || cell == "NaN" || cell == "NAN") return kNotMeasured;
    std::string text(cell);
    if (const auto comma = text.find(','); comma != std::string::npos && separator_ != ',') {
      if (text.find('.') != std::string::npos || (!comma_seen_ && point_was_seen()))
        refuse_mixture(line, column);
      text[comma] = '.';
      comma_seen_ = true;
    }
    const char* at = text.c_str();
    double value = kNotMeasured;
    if (!read_decimal(at, value) || at != text.c_str() + text.size())
      throw Error({.place = place(line, column),
                   .expected = "a number, nan or nothing",
                   .found = "'" + printable(whole) + "'",
                   .advice = "Correct the cell, or leave the column out with  drop: [" +
                             column.name + "]  in a mapping."});
    return value;
  }

  /// Asked once, at the first decimal comma: a broken number so far was written with a point.
  [[nodiscard]] bool point_was_seen() const {
    const auto is_broken = [](double value) {
      return std::isfinite(value) && std::trunc(value) != value;
    };
    return std::ranges::any_of(columns_, [&](const LogColumn& column) {
      return std::ranges::any_of(column.values, is_broken);
    });
  }

  void mark(std::size_t line) {
    if (table_.line_marks.empty() || line != last_line_ + 1)
      table_.line_marks.emplace_back(rows_, line);
    last_line_ = line;
  }

  [[nodiscard]] std::string place(std::size_t line, const LogColumn& column) const {
    return fmt::format("{}: line {}, column {} ({})", table_.source.file, line, column.number,
                       column.name);
  }

  [[noreturn]] void refuse_mixture(std::size_t line, const LogColumn& column) const {
    throw Error({.place = place(line, column),
                 .problem = "decimal commas and decimal points in one file",
                 .advice = "Export the log again with one of them and without thousands marks."});
  }

  [[noreturn]] void refuse_ragged(std::string_view line, std::size_t number) const {
    std::size_t found = 1;
    const char* const end = line.data() + line.size();
    for (const char* at = cell_end(line.data(), end); at != end; at = cell_end(at + 1, end))
      ++found;
    throw Error({.place = fmt::format("{}: line {}", table_.source.file, number),
                 .expected = fmt::format("{} cells, as in the header (line {})", columns_.size(),
                                         table_.header_line),
                 .found = fmt::format("{}", found),
                 .advice = "The line may have been cut off while logging: remove or correct it."});
  }

  LogTable& table_;
  char separator_;
  CsvLimits limits_;
  ReadBudget& budget_;
  std::vector<LogColumn> columns_;
  std::vector<std::uint8_t> read_;
  std::size_t rows_ = 0;
  std::size_t last_line_ = 0;
  bool comma_seen_ = false;
};

std::string nearest_or(std::string nearest, const char* otherwise) {
  return nearest.empty() ? otherwise : std::move(nearest);
}

void check_skipped(const CsvHeader& header, const CsvOptions& options, const std::string& place) {
  for (const std::string& name : options.skip)
    if (std::ranges::find(header.names, name) == header.names.end())
      throw Error({.place = place,
                   .problem = "there is no column '" + name + "' to drop",
                   .found = "the columns " + joined(header.names),
                   .advice = nearest_or(did_you_mean(name, header.names),
                                        "Logs of several kinds take a manifest, which gives each "
                                        "file its own mapping.")});
}

bool is_comment_or_blank(std::string_view line) { return line.empty() || line.front() == '#'; }

/// The first line that is neither blank nor a comment.
std::string_view header_line(LineReader& lines, const std::string& name, std::size_t limit) {
  std::string_view line;
  std::size_t bytes = 0;
  while (lines.next(line, limit)) {
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (lines.number() == 1 && line.starts_with(kByteOrderMark))
      line.remove_prefix(kByteOrderMark.size());
    if (!is_comment_or_blank(line)) return line;
    bytes += line.size() + 1;
    if (bytes > limit)
      throw Error({.place = name,
                   .problem = fmt::format("no header line within the first {} bytes", limit)});
  }
  throw Error({.place = name,
               .problem = lines.number() == 0 ? "the file is empty" : "no header line",
               .expected = "a header line and rows of numbers"});
}

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

}  // namespace

LogTable read_csv(ByteSource& source, const std::string& name, const CsvOptions& options) {
  LogTable table;
  table.source.file = name;
  LineReader lines(source, name);
  const std::string first(header_line(lines, name, options.limits.header_bytes));
  table.header_line = lines.number();
  const std::string place = fmt::format("{}: line {}", name, table.header_line);
  refuse_model(first, lines, name);
  const CsvHeader header = parse_header(first, place);
  check_skipped(header, options, place);
  ReadBudget budget(name);
  TableParser parser(table, header, options, budget);
  std::string_view line;
  std::size_t gap_bytes = 0;
  while (lines.next(line, options.limits.line_bytes)) {
    budget.read_to(source.bytes_read());
    constexpr std::size_t kTextPerElement = 16;  // comments of a packed file take time, too
    budget.work(1 + line.size() / kTextPerElement);
    if (!is_comment_or_blank(line)) {
      parser.add(line, lines.number());
      gap_bytes = 0;
      continue;
    }
    gap_bytes += line.size() + 1;
    if (gap_bytes > options.limits.gap_bytes)
      throw Error({.place = fmt::format("{}: line {}", name, lines.number()),
                   .expected = "a row of numbers",
                   .found = fmt::format("more than {} bytes of blank lines and comments",
                                        options.limits.gap_bytes),
                   .advice = "Remove them:  grep -Ev '^(#|$)' LOG.csv > SHORT.csv"});
  }
  if (parser.rows() == 0)
    throw Error({.place = name,
                 .problem = "no samples",
                 .expected = "rows of numbers below the header",
                 .found = "a header only"});
  parser.finish();
  table.source.sha256 = source.sha256();
  return table;
}

LogTable read_csv(const std::string& path, const CsvOptions& options) {
  const auto source = open_bytes(path, options.progress);
  return read_csv(*source, path == "-" ? "standard input" : path, options);
}

LogTable parse_csv(std::string_view bytes, const std::string& name, const CsvOptions& options) {
  const auto source = bytes_in_memory(bytes, name);
  return read_csv(*source, name, options);
}

}  // namespace torsio
