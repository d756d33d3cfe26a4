#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "data/mapping/unit_words.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

/// What to do about a column whose name ends in no known unit: the mapping line that would read it,
/// with the quantity that its name speaks of. An unknown unit is asked for as `scale:`, never taken
/// for a known one.
[[nodiscard]] std::string advice_without_unit(std::string_view column_name);

/// The line of `channels:` in that advice: "torque_Nm: {from: torque, unit: Nm}".
[[nodiscard]] std::string mapping_entry(std::string_view column_name);

/// What to write for a text after `unit:` that is not a known unit, with the list of those last.
[[nodiscard]] std::string advice_on_written_unit(std::string_view written,
                                                 std::string_view si_unit);

/// What a text in a row of units that is not a known unit means for the user, in one line.
[[nodiscard]] std::string note_on_unknown_unit(std::string_view written);

/// A text of a mapping, in quotes if it needs them.
[[nodiscard]] std::string yaml_name(std::string_view text);

/// A name that ends in a unit in brackets.
struct NameInBrackets {
  std::string quantity;  ///< with '_' in the place of blanks
  const Unit* unit = nullptr;
};

/// "Motor torque [Nm]", "Winkel (°)"; nothing if what is in brackets is not a known unit, or a number, which may
/// be an index.
[[nodiscard]] std::optional<NameInBrackets> unit_in_brackets(std::string_view name);

/// Whether the name of a column is like that of a clock: "stamp", "Time".
[[nodiscard]] bool is_like_clock(std::string_view column_name);

}  // namespace torsio
