#pragma once

#include <string_view>

#include "torsio/core/units.hpp"

namespace torsio {

/// A unit as people and loggers spell it, also in other languages: "[deg/s]", "seconds", "°", "N·m", "Grad", "tr/min";
/// null if it is not known, or has two meanings.
[[nodiscard]] const Unit* unit_in_words(std::string_view written);

/// The suffix of the known unit with that spelling, without regard to case; empty if there is none.
[[nodiscard]] std::string_view unit_spelled(std::string_view text);

/// "Inc", "counts", "Impulse": numbers of a converter or an encoder, whose size only the user can state.
[[nodiscard]] bool is_count(std::string_view unit);

/// "grad" without a capital: degrees in German, gradians in English and French.
[[nodiscard]] bool is_gradian_or_degree(std::string_view unit);
/// "gon": 400 in a turn.
[[nodiscard]] bool is_gradian(std::string_view unit);
inline constexpr std::string_view kAdviceOnGradians =
    "It may be degrees (German Grad, 360 in a turn): write  unit: deg  or gon (gradians, 400 in a "
    "turn): write  unit: rev, scale: 1/400";

/// A text without brackets around it.
[[nodiscard]] std::string_view without_frame(std::string_view text);

}  // namespace torsio
