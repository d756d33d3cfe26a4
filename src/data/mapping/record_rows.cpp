#include "data/mapping/record_rows.hpp"

#include <cmath>

namespace torsio {

std::vector<Rows> parts_between_gaps(std::span<const double> stamps_s, Rows rows, double gap_s) {
  constexpr std::size_t kFewest = 2;  // have a rate
  std::vector<Rows> parts;
  for (std::size_t begin = rows.begin, end = begin; begin < rows.end; begin = end) {
    do ++end;
    while (end < rows.end && stamps_s[end] >= stamps_s[end - 1] &&
           stamps_s[end] - stamps_s[end - 1] <= gap_s);
    if (const Rows part{.begin = begin, .end = end}; part.size() >= kFewest) parts.push_back(part);
  }
  return parts;
}

Rows rows_between(const TableChannels& columns, std::size_t rows, const Mapping& mapping,
                  double rate_Hz) {
  const double rate = mapping.rate_Hz > 0.0 ? mapping.rate_Hz : rate_Hz;
  const auto time_s = [&](std::size_t row) {
    if (!columns.clock) return static_cast<double>(row) / rate;
    const std::vector<double>& stamps_s = columns.clock->channel.values;
    return stamps_s[row] - stamps_s.front();
  };
  Rows used{.begin = 0, .end = rows};
  if (!columns.clock && !(rate > 0.0)) return used;  // `record_clock` refuses such a log
  if (mapping.from_s > 0.0)
    while (used.begin < rows && !(time_s(used.begin) >= mapping.from_s)) ++used.begin;
  if (std::isfinite(mapping.to_s)) {
    used.end = used.begin;
    while (used.end < rows && time_s(used.end) <= mapping.to_s) ++used.end;
  }
  return used;
}

}  // namespace torsio
