#pragma once

#include <string>
#include <vector>

namespace torsio {

/// A cell with so many decimals below 1e6, else with three significant digits: 1e300 has 301 digits.
[[nodiscard]] std::string fixed_text(double value, int decimals);

/// A table for the terminal: columns of numbers to the right (but never the first), of words to the left.
class TextTable {
 public:
  void header(const std::vector<std::string>& cells);  ///< appends columns
  void row(std::vector<std::string> cells);            ///< missing cells are empty
  [[nodiscard]] std::string text() const;
  [[nodiscard]] const std::vector<std::string>& headings() const noexcept { return header_; }
  [[nodiscard]] const std::vector<std::vector<std::string>>& rows() const noexcept { return rows_; }

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace torsio
