#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "core/lower.hpp"

namespace torsio {

/// Whether a cell is one of the marks that programs write where nothing was measured: "NA", "null", "-nan",
/// "#N/A", .. An infinite value is none.
[[nodiscard]] inline bool is_missing_mark(std::string_view cell) {
  constexpr std::array<std::string_view, 28> kMarks{
      "nan",   "na",    "n/a",    "n.a.",    "#n/a",    "#n/a n/a", "#na",
      "<na>",  "nat",   "null",   "(null)",  "none",    "nil",      "empty",
      "-",     "--",    "---",    "?",       "\\n",     "missing",  "undefined",
      "undef", "#num!", "#null!", "#value!", "#div/0!", "#ref!",    "1.#nan"};
  const std::string small = lower(cell);
  if (std::ranges::find(kMarks, small) != kMarks.end()) return true;
  std::string_view text = small;
  if (text.starts_with('-') || text.starts_with('+')) text.remove_prefix(1);
  return text == "nan" || text.starts_with("nan(") || text.starts_with("1.#qnan") ||
         text.starts_with("1.#snan") || text.starts_with("1.#ind");
}

}  // namespace torsio
