#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "data/mapping/columns.hpp"
#include "torsio/data/mapping.hpp"

namespace torsio {

/// Rows [begin, end) of a table that make one record.
struct Rows {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

/// The parts of some rows between intervals that are longer than `gap_s`, and from stamps that are earlier than those before. A
/// single row is left out: it has no rate.
[[nodiscard]] std::vector<Rows> parts_between_gaps(std::span<const double> stamps_s, Rows rows,
                                                   double gap_s);

/// The rows of a log that `from` and `to` of the mapping select; without clock by the sample rate.
[[nodiscard]] Rows rows_between(const TableChannels& columns, std::size_t rows,
                                const Mapping& mapping, double rate_Hz);

}  // namespace torsio
