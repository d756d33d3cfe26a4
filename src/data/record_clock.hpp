#pragma once

#include "data/log_table.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/record_rows.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/write.hpp"

namespace torsio {

struct RecordClock {
  double sample_rate_Hz = 0.0;
  double start_s = 0.0;
};

/// The clock of some rows by the mapping's rules; `rate_Hz` if neither log nor mapping has a rate.
[[nodiscard]] RecordClock record_clock(const LogTable& table, const TableChannels& columns,
                                       Rows rows, const Mapping& mapping, double rate_Hz);

}  // namespace torsio
