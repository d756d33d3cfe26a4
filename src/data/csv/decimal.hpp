#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

namespace torsio {

/// Reads one decimal number at `at`, which must be followed somewhere by a character that cannot
/// belong to a number; moves `at` to the end of it. Correctly rounded.
///
/// Up to 2^53 a mantissa is exact, and so are powers of ten up to 10^22: one multiplication or
/// division of the two rounds once, which is correct (Clinger 1990). Everything else goes to
/// std::from_chars.
/// @returns false, `at` unmoved, if there is no finite number.
inline bool read_decimal(const char*& at, double& value) {
  static constexpr std::array<double, 23> kPowers = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                     1e8,  1e9,  1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
                                                     1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  const auto digit = [](char c) { return static_cast<unsigned>(c) - unsigned{'0'}; };

  const char* p = at;
  const bool negative = *p == '-';
  if (negative || *p == '+') ++p;
  const char* const first = p;
  std::uint64_t mantissa = 0;
  while (digit(*p) < 10) mantissa = 10 * mantissa + digit(*p++);
  auto digits = p - first;
  std::int64_t exponent = 0;
  if (*p == '.') {
    const char* const fraction = ++p;
    while (digit(*p) < 10) mantissa = 10 * mantissa + digit(*p++);
    exponent = fraction - p;
    digits -= exponent;
  }
  if (digits == 0) return false;
  if (*p == 'e' || *p == 'E') {
    const char* q = p + 1;
    const bool negative_exponent = *q == '-';
    if (negative_exponent || *q == '+') ++q;
    std::int64_t written = 0;
    if (digit(*q) >= 10) return false;
    while (digit(*q) < 10) {
      if (written < 100'000'000) written = 10 * written + digit(*q);
      ++q;
    }
    exponent += negative_exponent ? -written : written;
    p = q;
  }

  double magnitude = 0.0;
  constexpr std::uint64_t kExact = std::uint64_t{1} << 53;
  if (digits <= 19 && mantissa <= kExact && exponent >= -22 && exponent <= 22) {
    magnitude = static_cast<double>(mantissa);
    if (exponent < 0)
      magnitude /= kPowers[static_cast<std::size_t>(-exponent)];
    else
      magnitude *= kPowers[static_cast<std::size_t>(exponent)];
  } else {
    const auto [end, code] = std::from_chars(first, p, magnitude);
    // from_chars does not change the value for too large and for too small numbers. Their first
    // digit distinguishes them: its value is about 10^exponent, far from 10^0.
    if (code == std::errc::result_out_of_range) {
      const char* at_digit = first;
      for (; at_digit != p && (*at_digit == '0' || *at_digit == '.'); ++at_digit)
        if (digit(*at_digit) < 10) --digits;
      if (exponent + digits > 0) return false;
      magnitude = 0.0;
    }
    if (!std::isfinite(magnitude)) return false;
  }
  value = negative ? -magnitude : magnitude;
  at = p;
  return true;
}

/// Whether a text is one number and nothing else.
[[nodiscard]] inline bool is_decimal(const std::string& text) {
  const char* at = text.c_str();
  double value = 0.0;
  return read_decimal(at, value) && at == text.c_str() + text.size();
}

}  // namespace torsio
