#pragma once

#include <optional>
#include <vector>

#include "data/log_table.hpp"
#include "torsio/data/csv.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/recording.hpp"

namespace torsio {

/// A channel in SI over all rows of a table, and the column that it came from.
struct TableChannel {
  Channel channel;
  const LogColumn* column = nullptr;
};

/// All rows of a table in SI, not yet cut or put on a clock.
struct TableChannels {
  std::optional<TableChannel> clock;
  std::vector<TableChannel> channels;
};

/// Renames and converts the columns, and puts freshness columns to their channels.
[[nodiscard]] TableChannels channels_of_table(const LogTable& table, const Mapping& mapping);

/// The column of that name. @throws Error that lists the columns, at `place`.
[[nodiscard]] const LogColumn& column_named(const LogTable& table, const std::string& name,
                                            const std::string& place);

}  // namespace torsio
