#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

namespace torsio {

/// Whether a cell is one of the marks that programs write where nothing was measured: "NA", "null", "-nan",
/// "#N/A", .. An infinite value is none.
[[nodiscard]] inline bool is_missing_mark(std::string_view cell) {
  constexpr std::array<std::string_view, 28> kMarks{
      "nan",   "na",    "n/a",    "n.a.",    "#n/a",    "#n/a n/a", "#na",
      "<na>",  "nat",   "null",   "(null)",  "none",    "nil",      "empty",
      "-",     "--",    "---",    "?",       "\\n",     "missing",  "undefined",
      "undef", "#num!", "#null!", "#value!", "#div/0!", "#ref!",    "1.#nan"};
  std::string lower(cell);
  std::ranges::transform(lower, lower.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (std::ranges::find(kMarks, lower) != kMarks.end()) return true;
  std::string_view text = lower;
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  return text == "nan" || text.starts_with("nan(") || text.starts_with("1.#qnan") ||
         text.starts_with("1.#snan") || text.starts_with("1.#ind");
}

}  // namespace torsio
