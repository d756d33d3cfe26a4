#include "export/warp_table.hpp"

#include <fmt/format.h>

#include <cmath>

namespace torsio {

std::string python_number(double value, int bits) {
  if (std::isnan(value)) return "float(\"nan\")";
  if (std::isinf(value)) return value > 0.0 ? "float(\"inf\")" : "float(\"-inf\")";
  const std::string text =
      bits == 32 ? fmt::format("{}", static_cast<float>(value)) : fmt::format("{}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::size_t WarpTable::add(const Matrix& values) {
  constexpr std::size_t kNumbersPerLine = 8;
  std::string text;
  for (const double value : values.values) text += python_number(value, bits_) + ", ";
  const auto [place, is_new] = known_.try_emplace(text, size_);
  if (!is_new) return place->second;
  for (std::size_t row = 0; row < values.rows; ++row) {
    text_ += "    ";
    for (std::size_t j = 0; j < values.columns; ++j) {
      if (j > 0) text_ += j % kNumbersPerLine == 0 ? ",\n    " : ", ";
      text_ += python_number(values(row, j), bits_);
    }
    text_ += ",\n";
  }
  size_ += values.values.size();
  return place->second;
}

}  // namespace torsio
