#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "data/inspect_clock.hpp"
#include "data/log_table.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/record_rows.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

inline constexpr double kLongestGapIntervals = 5.0;

/// The stamps of one record, with what is needed to complain about them.
struct Stamps {
  const LogTable& table;
  const TableChannels& columns;
  const Mapping& mapping;
  const LogColumn& column;
  Rows rows;
  std::span<const double> values_s;
  ClockReport report;

  [[nodiscard]] std::string place(std::size_t sample) const {
    return table.place(rows.begin + sample, column);
  }
};

/// Whether stamps are repeated, and each time with every value, as where a message comes twice.
[[nodiscard]] bool repeats_are_rows(const Stamps& stamps);

/// The gap from which on straight lines over it are doubtful.
[[nodiscard]] double usual_limit_s(const Stamps& stamps);

/// `rate:` of a mapping without the clock.
[[nodiscard]] std::string rate_line(const Stamps& stamps);

/// `resample:` within `clock:`.
[[nodiscard]] std::string resample_entry(const Stamps& stamps);

/// `clock:` of the mapping, with what it has already.
[[nodiscard]] std::string clock_line(const Stamps& stamps, std::string_view entry,
                                     double split_at_s = 0.0);

/// `clock:` of the mapping, with the rows sorted.
[[nodiscard]] std::string sort_line(const Stamps& stamps);

}  // namespace torsio
