#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "data/log_table.hpp"
#include "torsio/data/mapping.hpp"
#include "torsio/data/recording.hpp"
#include "torsio/data/write.hpp"

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

/// Renames and converts the columns, and puts freshness columns to their channels. The values of
/// the columns are moved into the channels, except for the column of `split_by`; the names stay.
/// Columns that the mapping drops are removed, and what was assumed is added to the notes.
[[nodiscard]] TableChannels channels_of_table(LogTable& table, const Mapping& mapping);

/// What a decoded number of its column is multiplied by to give the channel's value in SI, before the offset; none if
/// the unit of the channel or of the column is not known.
[[nodiscard]] std::optional<double> column_factor(const ChannelRule& rule,
                                                  const LogColumn& column) noexcept;

/// The columns that the channels and the clock were read from, with the units of their numbers.
[[nodiscard]] std::vector<ColumnOfChannel> columns_of_channels(const TableChannels& columns,
                                                               const Mapping& mapping);

/// "torque" of "torque_fresh_1", a mask of new samples; empty if the name is none of a mask.
[[nodiscard]] std::string_view marked_quantity(std::string_view name) noexcept;

/// What a value in that SI unit on the motor's side of a gear is multiplied by on its output side;
/// none if a gear does not change it.
[[nodiscard]] std::optional<double> gear_scale(std::string_view si_unit,
                                               double gear_ratio) noexcept;

/// The column of that name. @throws Error that lists the columns, at `place`.
[[nodiscard]] LogColumn& column_named(LogTable& table, const std::string& name,
                                      const std::string& place);

}  // namespace torsio
