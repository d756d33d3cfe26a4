#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "torsio/core/provenance.hpp"

namespace torsio {

/// Columns of texts that are a date, a time of day, or both; their values are in seconds.
enum class TimeKind : std::uint8_t { none, date_time, date, time_of_day };

/// One column of a log without conversion. A missing value is NaN.
struct LogColumn {
  std::string name;
  std::size_t number = 0;  ///< counted from 1 in the header
  std::vector<double> values;
  /// `Channel::fresh`, where the format has it.
  std::vector<std::uint8_t> fresh = {};
  TimeKind time = TimeKind::none;
  std::string_view unit = {};  ///< suffix of a known unit that the file specifies besides the name
  std::string unknown_unit = {};  ///< cell of a row of units that is none that torsio reads

  /// Whether name or file specify the unit.
  [[nodiscard]] bool has_unit() const noexcept;
  /// The name as torsio writes it, with the unit that the file specifies elsewhere or in brackets.
  [[nodiscard]] std::string full_name() const;
};

/// What every reader of a log makes of it: named columns of equal length, and where in the file a
/// row is, for messages. Mapping and clock are applied to it, whatever the format was.
struct LogTable {
  Source source;
  std::size_t header_line = 0;  ///< line of the names in a text; 0: the file is not a text
  std::vector<LogColumn> columns;
  /// (row, number of its line, message, ...) wherever the numbers jump, as at comments.
  std::vector<std::pair<std::size_t, std::size_t>> line_marks;
  std::string row_word = "line";  ///< what a row is in the file: "line", "message", "row"
  /// Names end in units. Where they are those of fields, only the columns that the mapping names,
  /// or that have a unit by chance, are channels.
  bool has_units = true;
  std::vector<std::string> other_columns = {};  ///< names of those that are not read, for messages
  std::vector<std::string> notes = {};          ///< what reading assumed, in sentences
  /// "z (complex numbers)": arrays that are not read, and why.
  std::vector<std::string> not_read = {};
  bool is_unfinished = false;  ///< the recorder was stopped before it closed the file
  // What the file states about the whole run.
  std::string recording_name = {};  ///< empty: the recording is named by the file
  std::vector<std::pair<std::string, double>> conditions = {};  ///< in SI
  std::vector<std::pair<std::string, std::string>> labels = {};
  /// The rate onto which uneven stamps are interpolated where neither mapping nor user states one; 0: they
  /// must be even.
  double resample_Hz = 0.0;

  [[nodiscard]] std::size_t rows() const noexcept {
    return columns.empty() ? 0 : columns.front().values.size();
  }
  [[nodiscard]] const LogColumn* find(std::string_view name) const noexcept;
  [[nodiscard]] std::size_t line_of(std::size_t row) const noexcept;
  [[nodiscard]] std::vector<std::string> column_names() const;  ///< also of those that are not read
  [[nodiscard]] std::string column_list() const;                ///< for error messages
  /// "sweep.csv: line 12, column 3 (torque_Nm)", "run.mcap: message 12, /imu/x"
  [[nodiscard]] std::string place(std::size_t row, const LogColumn& column) const;
  [[nodiscard]] std::string header_place(const LogColumn& column) const;
  [[nodiscard]] std::string header_place() const;
};

/// The note on columns that nothing names, and that have no unit.
[[nodiscard]] std::string note_of_left_out(const std::vector<std::string>& columns);

}  // namespace torsio
