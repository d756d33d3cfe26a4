#include "data/csv/decimal_marks.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "data/names.hpp"

namespace torsio {
namespace {

constexpr double kThousand = 1000.0;

}  // namespace

DecimalMarks::DecimalMarks(std::string file, std::string_view stated, char separator,
                           ReadBudget& budget)
    : file_(std::move(file)), stated_(stated), separator_(separator), budget_(budget) {
  if (!stated.empty()) mark_ = stated == "comma" ? DecimalMark::comma : DecimalMark::point;
  is_other_clear_ = !stated.empty();
}

double DecimalMarks::number_of(const Cell& cell) {
  const MarkedNumber number(cell.text);
  if (!number.is_number()) refuse_cell(cell.text, place_of(cell), cell.column.name);
  const bool has_comma = cell.text.find(',') != std::string_view::npos;
  const bool has_point = cell.text.find('.') != std::string_view::npos;
  // Between commas, a number with a comma is in quotes and one with a point is clear.
  const bool is_clear = number.fits_point != number.fits_comma ||
                        (separator_ == ',' && !has_comma && stated_.empty());
  if (is_clear) {
    prove(number, cell, has_comma, has_point);
  } else if (has_comma && mark_ != DecimalMark::comma && !is_other_clear_) {
    if (unclear_.empty()) unclear_comma_ = {place_of(cell), std::string(cell.text)};
    budget_.keep(sizeof(UnclearCell));
    unclear_.push_back({cell.index, cell.row});
    return number.with_comma;
  } else if (has_point && mark_ != DecimalMark::point && !is_other_clear_) {
    if (mark_ == DecimalMark::comma) refuse_mixture(place_of(cell));
    if (unclear_point_.empty()) unclear_point_ = place_of(cell);
    return number.with_point;
  }
  if ((is_point() ? has_comma : has_point) && example_of_other_.empty())
    example_of_other_ = cell.text;
  return is_point() ? number.with_point : number.with_comma;
}

void DecimalMarks::prove(const MarkedNumber& number, const Cell& cell, bool has_comma,
                         bool has_point) {
  const DecimalMark shown = number.fits_point ? DecimalMark::point : DecimalMark::comma;
  if (mark_ == DecimalMark::unknown) mark_ = shown;
  if (mark_ != shown && !stated_.empty()) refuse_other_mark(cell.text, place_of(cell), stated_);
  if (mark_ != shown) refuse_mixture(place_of(cell));
  if (mark_ == DecimalMark::comma && !unclear_point_.empty()) refuse_mixture(unclear_point_);
  is_other_clear_ = is_other_clear_ || (is_point() ? has_comma : has_point);
}

void DecimalMarks::finish(std::vector<LogColumn>& columns, std::size_t rows) const {
  if (mark_ == DecimalMark::comma || unclear_.empty()) return;
  if (!is_other_clear_) refuse_unclear(columns, rows);
  for (const UnclearCell& cell : unclear_) {
    double& value = columns[cell.column].values[cell.row];
    value = std::round(kThousand * value);
  }
}

std::string DecimalMarks::note() const {
  if (example_of_other_.empty()) return {};
  return fmt::format("{} are read as marks between thousands, for example in '{}'",
                     is_point() ? "commas" : "points", printable(example_of_other_));
}

void DecimalMarks::refuse_unclear(const std::vector<LogColumn>& columns, std::size_t rows) const {
  const std::size_t column = unclear_.front().column;
  std::vector<bool> is_unclear(rows, false);
  for (const UnclearCell& cell : unclear_)
    if (cell.column == column) is_unclear[cell.row] = true;
  bool has_small = false;
  bool has_large = false;
  for (std::size_t row = 0; row < rows; ++row) {
    const double value = columns[column].values[row];
    if (is_unclear[row] || std::isnan(value)) continue;
    (std::abs(value) < kThousand ? has_small : has_large) = true;
  }
  refuse_unclear_commas(unclear_comma_.cell, unclear_comma_.place, has_small && !has_large);
}

}  // namespace torsio
