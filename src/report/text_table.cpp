#include "torsio/report/text_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

namespace torsio {

std::string fixed_text(double value, int decimals) {
  constexpr double kReadable = 1e6;
  return std::abs(value) < kReadable ? fmt::format("{:.{}f}", value, decimals)
                                     : fmt::format("{:.3g}", value);
}

void TextTable::header(const std::vector<std::string>& cells) {
  header_.insert(header_.end(), cells.begin(), cells.end());
}

void TextTable::row(std::vector<std::string> cells) {
  cells.resize(header_.size());
  rows_.push_back(std::move(cells));
}

namespace {

constexpr std::size_t kLongestNumber = 24;  // with its unit; a longer text begins with a number

/// Whether a cell is a number; a missing one is not.
bool is_numeric(const std::string& cell) {
  if (cell.size() > kLongestNumber) return false;
  return cell.empty() || cell == "nan" ||
         std::string_view("0123456789+-.<").find(cell.front()) != std::string_view::npos;
}

}  // namespace

std::string TextTable::text() const {
  std::vector<std::size_t> widths;
  std::vector<char> is_number;
  for (std::size_t column = 0; column < header_.size(); ++column) {
    std::size_t width = header_[column].size();
    for (const auto& row : rows_) width = std::max(width, row[column].size());
    widths.push_back(width);
    is_number.push_back(static_cast<char>(
        std::ranges::all_of(rows_, [&](const auto& row) { return is_numeric(row[column]); })));
  }
  std::string text;
  const auto append = [&](const std::vector<std::string>& cells) {
    std::string line;
    for (std::size_t column = 0; column < cells.size(); ++column) {
      line += column == 0 ? "" : "  ";
      line += is_number[column] != 0 && column > 0
                  ? fmt::format("{:>{}}", cells[column], widths[column])
                  : fmt::format("{:<{}}", cells[column], widths[column]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  };
  append(header_);
  for (const auto& row : rows_) append(row);
  return text;
}

}  // namespace torsio
