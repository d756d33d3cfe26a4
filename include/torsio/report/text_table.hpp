#pragma once

#include <string>
#include <vector>

namespace torsio {

/// A table for the terminal: columns of numbers to the right (but never the first), of words to the left.
class TextTable {
 public:
  void header(const std::vector<std::string>& cells);  ///< appends columns
  void row(std::vector<std::string> cells);            ///< missing cells are empty
  [[nodiscard]] std::string text() const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace torsio
