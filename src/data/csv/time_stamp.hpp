#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "data/log_table.hpp"

namespace torsio {

/// A date, a time of day, or both, as text.
struct TimeStamp {
  TimeKind kind = TimeKind::none;
  double time_s = 0.0;  ///< since 1970 in UTC, or of the day
  bool has_zone = false;
};

/// ISO 8601 with 'T' or a blank, a fraction, and a zone or none; dates also as 2024/03/01 and 01.03.2024; a
/// time of day as 12:34:56, 12:34:56:789, 1:02:03 PM or 34:56.789; "0 days 00:00:01.5". Nothing for other texts, dates such
/// as 1/3/2024 among them, which are read in two ways.
[[nodiscard]] std::optional<TimeStamp> read_time_stamp(std::string_view text);

/// In the format of strptime. A fraction may follow the seconds.
[[nodiscard]] std::optional<TimeStamp> read_time_stamp(std::string_view text,
                                                       const std::string& format);

/// Whether a text may be a date or a time, in whatever format.
[[nodiscard]] bool is_like_time(std::string_view text) noexcept;

/// A format of strptime that may be that of the text. Of two numbers that may be month and day, the first is
/// the month unless points separate them.
[[nodiscard]] std::string likely_time_format(std::string_view text);

}  // namespace torsio
