#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <string_view>

#include "core/trimmed.hpp"
#include "data/byte_source.hpp"
#include "data/csv/csv_errors.hpp"
#include "data/csv/csv_header.hpp"
#include "data/csv/csv_start.hpp"
#include "data/csv/csv_table.hpp"
#include "data/csv/decimal.hpp"
#include "data/csv/decimal_marks.hpp"
#include "data/csv/line_reader.hpp"
#include "data/csv/missing_mark.hpp"
#include "data/csv/number_marks.hpp"
#include "data/csv/time_stamp.hpp"
#include "data/mapping/column_advice.hpp"
#include "data/mapping/columns.hpp"
#include "data/names.hpp"
#include "data/read_budget.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"
#include "torsio/data/write.hpp"

namespace torsio {
namespace {

/// As pandas names a column that had no name.
bool is_nameless(std::string_view name) {
  constexpr std::string_view kUnnamed = "Unnamed: ";
  if (!name.starts_with(kUnnamed)) return name.empty();
  name.remove_prefix(kUnnamed.size());
  return !name.empty() &&
         std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c) != 0; });
}

bool has_letter(std::string_view cell) {
  return std::ranges::any_of(cell, [](unsigned char c) { return std::isalpha(c) != 0; });
}

bool is_among(const std::vector<std::string>& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// Turns lines into rows of a table.
class TableParser {
 public:
  TableParser(LogTable& table, const CsvStart& start, const CsvOptions& options, ReadBudget& budget)
      : table_(table),
        start_(start),
        separator_(start.header.separator),
        options_(options),
        budget_(budget),
        state_(start.header.names.size()),
        marks_(table.source.file, options.rules.decimal, start.header.separator, budget) {
    for (std::size_t i = 0; i < state_.size(); ++i) {
      columns_.push_back({.name = start.header.names[i], .number = i + 1, .values = {}});
      const std::string unit_cell = i < start.units.size() ? start.units[i] : std::string();
      const Unit* unit = unit_cell == "-" ? find_unit("1") : unit_in_words(unit_cell);
      const auto in_brackets = unit_in_brackets(columns_.back().name);
      if (unit == nullptr && in_brackets && !split_channel_name(columns_.back().name)) {
        unit = in_brackets->unit;
        if (column_in_brackets_.empty()) column_in_brackets_ = columns_.back().name;
      }
      if (unit != nullptr)
        columns_.back().unit = unit->suffix;
      else if (has_letter(unit_cell))
        columns_.back().unknown_unit = without_frame(unit_cell);
    }
    for (const std::string& mark : options.rules.missing) {
      const char* at = mark.c_str();
      double value = 0.0;
      if (read_decimal(at, value) && *at == '\0') missing_numbers_.push_back(value);
    }
    for (std::size_t i = 0; i < columns_.size(); ++i)
      state_[i].is_complete = is_complete(columns_[i]);
    choose_columns();
  }

  /// Whether a line is the header or the row of units once more: a logger that was started twice writes both again.
  [[nodiscard]] bool is_header_again(std::string_view line) const {
    const auto first = static_cast<unsigned char>(line.front());
    if (std::isalpha(first) == 0 && first != '"' && first != '[' && line.front() != separator_)
      return false;
    const std::vector<std::string> cells = cells_of(line, separator_);
    return cells == start_.header.names || cells == start_.units;
  }

  void skip_header(std::size_t number) {
    if (header_again_ == 0) header_again_ = number;
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
      const char* after = at;
      if (rows_ == 0 && state_[i].is_read_if_time) choose_by_cell(i, {at, cell_end(at, end)});
      if (!state_[i].is_read) {
        at = cell_end(at, end);
        continue;
      }
      double value = kNotMeasured;
      if (!read_decimal(after, value) || (after != end && *after != separator_)) {
        after = cell_end(at, end);
        value = unusual_cell({at, after}, number, i);
      } else {
        const std::string_view cell(at, after);
        if (!marks_.is_point() && cell.find('.') != std::string_view::npos)
          value = marked_number(cell, number, i);
        value = unless_missing(value, cell, i);
      }
      if (state_[i].is_read) columns_[i].values.push_back(value);
      at = after;
    }
    if (at != end) skip_empty_cells({at, end}, line, number);
    mark(number);
    budget_.keep(columns_.size() * sizeof(double));
    if (++rows_ * columns_.size() > options_.limits.values)
      throw Error({.place = fmt::format("{}: line {}", table_.source.file, number),
                   .problem = fmt::format("more than {} numbers", options_.limits.values),
                   .advice = "Cut the log into several files."});
  }

  void finish() {
    marks_.finish(columns_, rows_);
    if (const std::string note = marks_.note(); !note.empty()) table_.notes.push_back(note);
    if (!with_thousands_marks_.empty())
      table_.notes.push_back(fmt::format("marks between thousands are read, for example in '{}'",
                                         printable(with_thousands_marks_)));
    finish_times();
    note_unknown_units();
    std::vector<std::string> left_out;
    std::vector<std::string> nameless;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (state_[i].is_read) {
        table_.columns.push_back(std::move(columns_[i]));
        continue;
      }
      if (is_nameless(columns_[i].name))
        nameless.push_back(fmt::format("{}", i + 1));
      else if (state_[i].is_left_out)
        left_out.push_back(columns_[i].name);
      if (!columns_[i].name.empty()) table_.other_columns.push_back(columns_[i].name);
    }
    if (!nameless.empty())
      table_.notes.push_back("columns without a name are not read: " + joined(nameless));
    if (!left_out.empty()) table_.notes.push_back(note_of_left_out(left_out));
    std::vector<std::string> marks;
    for (const auto& [mark, times] : missing_marks_)
      marks.push_back(fmt::format("'{}' ({})", printable(mark), times));
    if (!marks.empty())
      table_.notes.push_back("cells that are read as not measured: " + joined(marks));
    if (!column_in_brackets_.empty())
      table_.notes.push_back(
          fmt::format("units in brackets in the header are read, such as that of '{}'",
                      printable(column_in_brackets_)));
    if (header_again_ > 0)
      table_.notes.push_back(fmt::format(
          "the header is repeated, first in line {}: it is not read again", header_again_));
    if (has_empty_ends_)
      table_.notes.emplace_back("empty cells after the last column are not read");
    if (has_local_times_) table_.notes.emplace_back("time stamps without a zone are read as UTC");
  }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }

 private:
  struct ColumnState {
    bool is_read = true;
    bool is_left_out = false;  ///< because the mapping does not name it
    bool is_read_if_time = false;
    bool is_complete = false;  ///< numbers for what was not measured are numbers here
    std::size_t time_stamps = 0;
  };

  /// Columns of numbers that no mapping reads: below a date there may be its format.
  void note_unknown_units() {
    constexpr std::size_t kMaxWords = 8;
    constexpr std::size_t kMaxNamed = 4;
    std::map<std::string_view, std::vector<std::string>> columns_by_word;
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (const LogColumn& column = columns_[i];
          state_[i].is_read && column.time == TimeKind::none && !column.unknown_unit.empty() &&
          !is_among(options_.wanted, column.name) && columns_by_word.size() < kMaxWords)
        columns_by_word[column.unknown_unit].push_back(printable(column.name));
    for (const auto& [word, names] : columns_by_word)
      table_.notes.push_back(fmt::format("the row of units has '{}' for {}: {}", printable(word),
                                         listed(names, kMaxNamed), note_on_unknown_unit(word)));
  }

  /// Whether it is the clock, a time, a mask, or a column that the mapping uses as one of them.
  [[nodiscard]] bool is_complete(const LogColumn& column) const {
    const auto name = split_channel_name(column.full_name());
    return is_among(options_.rules.complete, column.name) ||
           !marked_quantity(column.name).empty() || (name && name->unit->si_suffix == "s");
  }

  void choose_columns() {
    std::map<std::string_view, std::size_t> seen;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const LogColumn& column = columns_[i];
      ColumnState& state = state_[i];
      const bool is_wanted = is_among(options_.wanted, column.name);
      if (is_matched_by_any(column.name, options_.skip) ||
          (is_nameless(column.name) && !is_wanted)) {
        state.is_read = false;
      } else if (options_.rules.only_wanted && !is_wanted && !column.has_unit()) {
        state = {.is_read = false, .is_left_out = true, .is_read_if_time = true};
      }
      if (!state.is_read) continue;
      const auto [first, is_new] = seen.emplace(column.name, column.number);
      if (!is_new && options_.rules.leaves_out_texts)
        leave_out(i, fmt::format("column {}: column {} has the same name", i + 1, first->second));
      else if (!is_new)
        throw Error(
            {.place = place(table_.header_line, column),
             .problem = fmt::format("duplicate column: column {} has the same name", first->second),
             .advice = "Rename one of them in the file."});
    }
  }

  /// For a list: the column is not read, for that reason.
  void leave_out(std::size_t column, const std::string& reason) {
    state_[column].is_read = false;
    columns_[column].values.clear();
    table_.not_read.push_back(fmt::format("{} ({})", printable(columns_[column].name), reason));
  }

  void choose_by_cell(std::size_t column, std::string_view cell) {
    state_[column].is_read_if_time = false;
    if (!time_stamp(stripped(cell))) return;
    state_[column].is_read = true;
    state_[column].is_left_out = false;
  }

  [[nodiscard]] std::optional<TimeStamp> time_stamp(std::string_view cell) const {
    if (!options_.rules.time_format.empty())
      if (const auto stamp = read_time_stamp(cell, options_.rules.time_format)) return stamp;
    return read_time_stamp(cell);
  }

  [[nodiscard]] const char* cell_end(const char* at, const char* end) const {
    bool quoted = false;
    for (; at != end && (quoted || *at != separator_); ++at)
      if (*at == '"') quoted = !quoted;
    return at;
  }

  /// Without blanks and quotes around it.
  [[nodiscard]] static std::string_view stripped(std::string_view cell) {
    cell = trimmed(cell);
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
      cell = trimmed(cell.substr(1, cell.size() - 2));
    return cell;
  }

  /// Everything but a plain number: blanks, quotes, marks of what is missing, dates, commas.
  double unusual_cell(std::string_view whole, std::size_t line, std::size_t index) {
    const LogColumn& column = columns_[index];
    const std::string_view cell = stripped(whole);
    if (cell.empty() || cell == "nan" || cell == "NaN" || cell == "NAN") return kNotMeasured;
    if (is_missing_mark(cell) || (is_among(options_.rules.missing, cell) &&
                                  !(state_[index].is_complete && is_decimal(std::string(cell)))))
      return missing(cell);
    if (const auto stamp = time_stamp(cell)) return add_time(*stamp, line, index);
    double code = 0.0;
    if (read_hexadecimal(cell, code)) return unless_missing(code, cell, index);
    if (const std::string usual = without_thousands_marks(cell);
        !usual.empty() && MarkedNumber(usual).is_number()) {
      if (with_thousands_marks_.empty()) with_thousands_marks_ = cell;
      return unless_missing(marked_number(usual, line, index), cell, index);
    }
    if (const std::string usual = usual_spelling(cell);
        !usual.empty() && MarkedNumber(usual).is_number())
      return unless_missing(marked_number(usual, line, index), cell, index);
    if (cell.find_first_of(",.") != std::string_view::npos)
      return unless_missing(marked_number(cell, line, index), cell, index);
    const std::string text(cell);
    const char* at = text.c_str();
    double value = kNotMeasured;
    if (!read_decimal(at, value) || at != text.c_str() + text.size()) {
      if (!options_.rules.leaves_out_texts) refuse_cell(cell, place(line, column), column.name);
      leave_out(index, fmt::format("text, in line {}: '{}'", line, printable(cell)));
    }
    return unless_missing(value, cell, index);
  }

  /// A number with commas or points.
  double marked_number(std::string_view cell, std::size_t line, std::size_t index) {
    return marks_.number_of(
        {.text = cell, .line = line, .row = rows_, .index = index, .column = columns_[index]});
  }

  double add_time(const TimeStamp& stamp, std::size_t line, std::size_t index) {
    LogColumn& column = columns_[index];
    if (column.time != TimeKind::none && column.time != stamp.kind)
      throw Error(
          {.place = place(line, column), .problem = "dates, times of day and both in one column"});
    column.time = stamp.kind;
    ++state_[index].time_stamps;
    if (stamp.kind == TimeKind::date_time && !stamp.has_zone) has_local_times_ = true;
    return stamp.time_s;
  }

  /// Checks the columns of dates and times, and adds a date to the time of day in another column.
  void finish_times() {
    std::vector<std::size_t> dates;
    std::vector<std::size_t> times;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const LogColumn& column = columns_[i];
      if (column.time == TimeKind::none || !state_[i].is_read) continue;
      const auto values =
          std::ranges::count_if(column.values, [](double value) { return !std::isnan(value); });
      if (static_cast<std::size_t>(values) != state_[i].time_stamps)
        throw Error({.place = table_.header_place(column),
                     .problem = "the column has numbers and time stamps",
                     .advice = "Correct the cells, or leave the column out with  drop: [" +
                               yaml_name(column.name) + "]  in a mapping."});
      if (column.time == TimeKind::date) dates.push_back(i);
      if (column.time == TimeKind::time_of_day) times.push_back(i);
    }
    if (dates.size() == 1 && times.size() == 1) {
      LogColumn& time = columns_[times.front()];
      const LogColumn& date = columns_[dates.front()];
      for (std::size_t row = 0; row < time.values.size(); ++row)
        time.values[row] += date.values[row];
      time.time = TimeKind::date_time;
      state_[dates.front()].is_read = false;
      has_local_times_ = true;
      table_.notes.push_back(fmt::format("the dates in '{}' are added to the times in '{}'",
                                         printable(date.name), printable(time.name)));
      return;
    }
    for (const std::size_t i : times) unwrap_midnight(columns_[i].values);
  }

  static void unwrap_midnight(std::vector<double>& times_s) {
    constexpr double kDay_s = 86400.0;
    double days_s = 0.0;
    double before_s = kNotMeasured;
    for (double& time_s : times_s) {
      if (std::isnan(time_s)) continue;
      if (time_s < before_s - kDay_s / 2.0) days_s += kDay_s;
      before_s = time_s;
      time_s += days_s;
    }
  }

  double missing(std::string_view cell) {
    constexpr std::size_t kMaxMarks = 20;
    if (const auto known = missing_marks_.find(cell); known != missing_marks_.end())
      ++known->second;
    else if (missing_marks_.size() < kMaxMarks)
      missing_marks_.emplace(cell, 1);
    return kNotMeasured;
  }

  double unless_missing(double value, std::string_view cell, std::size_t index) {
    const bool is_missing = !missing_numbers_.empty() && !state_[index].is_complete &&
                            std::ranges::find(missing_numbers_, value) != missing_numbers_.end();
    return is_missing ? missing(cell) : value;
  }

  void mark(std::size_t line) {
    if (table_.line_marks.empty() || line != last_line_ + 1)
      table_.line_marks.emplace_back(rows_, line);
    last_line_ = line;
  }

  [[nodiscard]] std::string place(std::size_t line, const LogColumn& column) const {
    return csv_place(table_.source.file, line, column);
  }

  /// Many programs write a separator after the last cell, but none in the header.
  void skip_empty_cells(std::string_view rest, std::string_view line, std::size_t number) {
    const auto is_empty = [&](char c) { return c == separator_ || c == ' '; };
    if (!std::ranges::all_of(rest, is_empty)) refuse_ragged(line, number);
    has_empty_ends_ = true;
  }

  [[noreturn]] void refuse_ragged(std::string_view line, std::size_t number) const {
    std::size_t found = 1;
    const char* const end = line.data() + line.size();
    for (const char* at = cell_end(line.data(), end); at != end; at = cell_end(at + 1, end))
      ++found;
    refuse_cells(fmt::format("{}: line {}", table_.source.file, number), found,
                 {.names = columns_.size(), .line = table_.header_line, .separator = separator_});
  }

  LogTable& table_;
  const CsvStart& start_;
  char separator_;
  const CsvOptions& options_;
  ReadBudget& budget_;
  std::vector<LogColumn> columns_;
  std::vector<ColumnState> state_;
  std::string column_in_brackets_;  ///< the first whose unit is there
  std::vector<double> missing_numbers_;
  std::map<std::string, std::size_t, std::less<>> missing_marks_;
  std::size_t rows_ = 0;
  std::size_t last_line_ = 0;
  std::size_t header_again_ = 0;  ///< its first line; 0: none
  DecimalMarks marks_;
  std::string with_thousands_marks_;  ///< the first cell with an apostrophe or a space between them
  bool has_local_times_ = false;
  bool has_empty_ends_ = false;
};

}  // namespace

LogTable read_csv(ByteSource& source, const std::string& name, const CsvOptions& options) {
  LogTable table;
  table.source.file = name;
  LineReader lines(source, name);
  const CsvStart start = read_start(lines, name, options);
  table.header_line = start.line;
  table.notes = start.notes;
  ReadBudget budget(name);
  TableParser parser(table, start, options, budget);
  std::size_t gap_bytes = 0;
  const auto take = [&](std::string_view line, std::size_t number) {
    budget.read_to(source.bytes_read());
    if (table.is_unfinished)
      throw Error({.place = fmt::format("{}: line {}", name, number),
                   .expected = "the end of the file, after zero bytes in the line before",
                   .found = "a further line",
                   .advice = "The file is damaged there: cut it in two files."});
    if (line.find('\0') !=
        std::string_view::npos) {  // a computer without power before it had written
      table.is_unfinished = true;
      table.notes.push_back(
          fmt::format("line {} has zero bytes: it is not read, the rows before are", number));
      return;
    }
    constexpr std::size_t kTextPerElement = 16;  // comments of a packed file take time, too
    budget.work(1 + line.size() / kTextPerElement);
    if (!is_comment_or_blank(line)) {
      if (parser.is_header_again(line))
        parser.skip_header(number);
      else
        parser.add(line, number);
      gap_bytes = 0;
      return;
    }
    gap_bytes += line.size() + 1;
    if (gap_bytes > options.limits.gap_bytes)
      throw Error({.place = fmt::format("{}: line {}", name, number),
                   .expected = "a row of numbers",
                   .found = fmt::format("more than {} bytes of blank lines and comments",
                                        options.limits.gap_bytes),
                   .advice = "Remove them:  grep -Ev '^(#|$)' LOG.csv > SHORT.csv"});
  };
  for (const LineAhead& ahead : start.ahead) take(ahead.line(), ahead.number);
  std::string_view line;
  while (lines.next(line, options.limits.line_bytes)) take(line, lines.number());
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
