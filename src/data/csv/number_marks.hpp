#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

#include "data/csv/decimal.hpp"

namespace torsio {

/// The mark before the decimals of a file; the other one of the two then separates thousands.
enum class DecimalMark : unsigned char { unknown, point, comma };

/// A number in which `thousands` separates groups of three digits and `decimal` the decimals, with a point and without
/// the groups. @returns whether it is one: groups are complete, do not begin with a zero, and are not followed by an exponent.
[[nodiscard]] inline bool read_marked(std::string_view cell, char decimal, char thousands,
                                      double& value) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::string text;
  std::size_t i = 0;
  if (i < cell.size() && (cell[i] == '-' || cell[i] == '+')) text += cell[i++];
  const std::size_t first = i;
  std::size_t group = 0;
  bool has_groups = false;
  for (; i < cell.size() && (is_digit(cell[i]) || cell[i] == thousands); ++i) {
    if (is_digit(cell[i])) {
      text += cell[i];
      ++group;
      continue;
    }
    if (group == 0 || group > 3 || cell[first] == '0' || (has_groups && group != 3)) return false;
    has_groups = true;
    group = 0;
  }
  if (has_groups && group != 3) return false;
  bool has_decimals = false;
  if (i < cell.size() && cell[i] == decimal) {
    has_decimals = true;
    text += '.';
    ++i;
  }
  if (has_groups && !has_decimals && i < cell.size()) return false;
  text += cell.substr(i);
  const char* at = text.c_str();
  return read_decimal(at, value) && at == text.c_str() + text.size() &&
         (!has_decimals || text.find('.') == text.rfind('.'));
}

/// A number with the minus sign of Unicode or the exponent of Fortran (1.5D+03), in the usual spelling; nothing if it has
/// neither.
[[nodiscard]] inline std::string usual_spelling(std::string_view cell) {
  constexpr std::string_view kMinus = "\xe2\x88\x92";
  std::string text(cell);
  bool is_other = false;
  for (auto at = text.find(kMinus); at != std::string::npos; at = text.find(kMinus)) {
    text.replace(at, kMinus.size(), "-");
    is_other = true;
  }
  const auto exponent = text.find_first_of("dD");
  if (exponent != std::string::npos && exponent > 0 &&
      text.find_first_not_of("+-0123456789.,dD") == std::string::npos) {
    text[exponent] = 'e';
    is_other = true;
  }
  return is_other ? text : std::string();
}

/// A number in which groups of three digits are separated by an apostrophe, a no-break space or a thin space, without
/// these marks; nothing if it has none, or they are elsewhere.
[[nodiscard]] inline std::string without_thousands_marks(std::string_view cell) {
  constexpr std::array<std::string_view, 6> kMarks{
      "'", "\xe2\x80\x99", "\xe2\x80\xaf", "\xe2\x80\x89", "\xc2\xa0", "\xa0"};
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  for (const std::string_view mark : kMarks) {
    auto at = cell.find(mark);
    if (at == std::string_view::npos) continue;
    const std::size_t first = cell.find_first_not_of("+-");
    if (first > 1 || at == first || at > first + 3 || cell[first] == '0') return {};
    std::string text(cell.substr(0, at));
    while (at < cell.size() && cell.substr(at).starts_with(mark)) {
      const std::string_view group = cell.substr(at + mark.size(), 3);
      if (group.size() < 3 || !std::ranges::all_of(group, is_digit)) return {};
      text += group;
      at += mark.size() + 3;
    }
    const std::string_view rest = cell.substr(at);
    if (!std::ranges::all_of(text.substr(first), is_digit) ||
        (!rest.empty() && rest.front() != '.' && rest.front() != ',') ||
        rest.find_first_not_of(".,0123456789") != std::string_view::npos)
      return {};
    return text + std::string(rest);
  }
  return {};
}

/// A whole number in hexadecimal digits, such as 0x1F or -0x1f.
[[nodiscard]] inline bool read_hexadecimal(std::string_view cell, double& value) {
  constexpr std::size_t kMaxDigits = 13;  // exact
  const bool is_negative = cell.starts_with('-');
  if (is_negative) cell.remove_prefix(1);
  if (!cell.starts_with("0x") && !cell.starts_with("0X")) return false;
  cell.remove_prefix(2);
  std::uint64_t number = 0;
  const auto [end, code] = std::from_chars(cell.data(), cell.data() + cell.size(), number, 16);
  if (code != std::errc() || end != cell.data() + cell.size() || cell.size() > kMaxDigits)
    return false;
  value = (is_negative ? -1.0 : 1.0) * static_cast<double>(number);
  return true;
}

/// A number under both meanings of its commas and points.
struct MarkedNumber {
  double with_point = 0.0;  ///< the point is before the decimals
  double with_comma = 0.0;
  bool fits_point = false;
  bool fits_comma = false;

  explicit MarkedNumber(std::string_view cell)
      : fits_point(read_marked(cell, '.', ',', with_point)),
        fits_comma(read_marked(cell, ',', '.', with_comma)) {}
  [[nodiscard]] bool is_number() const noexcept { return fits_point || fits_comma; }
};

}  // namespace torsio
