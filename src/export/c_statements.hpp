#pragma once

#include <cstddef>
#include <string>

#include "export/c_text.hpp"

namespace torsio {

// Statements and functions that several parts of the program use.

/// Writes `NAME_cell(knots, count, x, &share)`: the knot to the left of x, and how far x is to the right one.
void need_cell(CText& c);
/// Writes the type `NAME_filter` and `NAME_lowpass(filter, gains, x)`.
void need_lowpass(CText& c);
/// Writes `NAME_from_fixed(value)`: an int64_t as a real number.
void need_fixed(CText& c);
/// Writes `NAME_divided(value, by)`: an int64_t by a number below 65536.
void need_divided(CText& c);
/// A statement that sets an array of reals to 0. A plain loop would become a call of memset.
[[nodiscard]] std::string cleared(CText& c, const std::string& array, std::size_t count);
/// The same for an array of floats.
[[nodiscard]] std::string cleared_floats(CText& c, const std::string& array, std::size_t count);
/// A number of things as a literal: "8U".
[[nodiscard]] std::string counted(std::size_t number);

}  // namespace torsio
