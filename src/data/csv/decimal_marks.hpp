#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "data/csv/csv_errors.hpp"
#include "data/csv/number_marks.hpp"
#include "data/log_table.hpp"
#include "data/read_budget.hpp"

namespace torsio {

/// Which of comma and point is before the decimals of a file. A number such as 1,5 or 1,234.5 proves it; until one does,
/// numbers such as 1,234 are unclear, and get their meaning at the end.
class DecimalMarks {
 public:
  /// @param stated "comma" or "point", as a mapping states it; empty: it is found
  DecimalMarks(std::string file, std::string_view stated, char separator, ReadBudget& budget);

  /// Whether a cell that a plain number was read from needs no `number_of`.
  [[nodiscard]] bool is_point() const noexcept { return mark_ == DecimalMark::point; }

  struct Cell {
    std::string_view text;
    std::size_t line = 0;
    std::size_t row = 0;
    std::size_t index = 0;  ///< its column in the table
    const LogColumn& column;
  };
  /// The number in a cell with commas or points. @throws Error if it is none, or has another mark than the file.
  double number_of(const Cell& cell);

  /// Gives the cells that were unclear the meaning that a later one proved. @throws Error if none did.
  void finish(std::vector<LogColumn>& columns, std::size_t rows) const;
  /// What is noted about marks between thousands; empty without any.
  [[nodiscard]] std::string note() const;

 private:
  /// A cell whose comma may be before decimals or between thousands.
  struct UnclearCell {
    std::size_t column = 0;
    std::size_t row = 0;
  };
  struct Example {
    std::string place;
    std::string cell;
  };

  void prove(const MarkedNumber& number, const Cell& cell, bool has_comma, bool has_point);
  [[nodiscard]] std::string place_of(const Cell& cell) const {
    return csv_place(file_, cell.line, cell.column);
  }
  [[noreturn]] void refuse_unclear(const std::vector<LogColumn>& columns, std::size_t rows) const;

  std::string file_;
  std::string stated_;
  char separator_;
  ReadBudget& budget_;
  DecimalMark mark_ = DecimalMark::unknown;
  bool is_other_clear_ = false;       ///< the other mark is one between thousands
  std::vector<UnclearCell> unclear_;  ///< while the mark is not known
  Example unclear_comma_;             ///< the first one
  std::string unclear_point_;         ///< place of the first one
  std::string example_of_other_;      ///< the first cell with it
};

}  // namespace torsio
