#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "data/log_table.hpp"
#include "data/mapping/columns.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

namespace torsio {

/// Rows [begin, end) of a table that make one record.
struct Rows {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

struct RecordClock {
  double sample_rate_Hz = 0.0;
  double start_s = 0.0;
};

/// The clock of some rows by the mapping's rules; `rate_Hz` if neither log nor mapping has a rate.
[[nodiscard]] RecordClock record_clock(const LogTable& table, const TableChannels& columns,
                                       Rows rows, const Mapping& mapping, double rate_Hz);

/// The parts of some rows between intervals that are longer than `gap_s`, and from stamps that are earlier than those before. A
/// single row is left out: it has no rate.
[[nodiscard]] std::vector<Rows> parts_between_gaps(std::span<const double> stamps_s, Rows rows,
                                                   double gap_s);

/// The rows of a log that `from` and `to` of the mapping select; without clock by the sample rate.
[[nodiscard]] Rows rows_between(const TableChannels& columns, std::size_t rows,
                                const Mapping& mapping, double rate_Hz);

/// Samples that share a stamp, spread evenly up to the next stamp (the last ones as those before),
/// so that stamps coarser than the sampling give a time for each sample.
[[nodiscard]] std::vector<double> spread_within_stamps(std::span<const double> stamps_s);

/// Puts a channel of uneven stamps onto an even clock of so many samples: interpolated, or held if
/// it has a mask.
[[nodiscard]] Channel on_even_clock(const Channel& channel, std::span<const double> stamps_s,
                                    double sample_rate_Hz, std::size_t samples);

}  // namespace torsio
