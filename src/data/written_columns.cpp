#include "data/written_columns.hpp"

#include <cmath>
#include <set>
#include <utility>

#include "torsio/core/error.hpp"
#include "torsio/core/units.hpp"

namespace torsio {

std::string freshness_column(std::string_view channel_name) {
  const auto parts = split_channel_name(channel_name);
  return std::string(parts ? parts->quantity : channel_name) + "_fresh_1";
}

void check_columns(const Recording& recording) {
  std::set<std::string> names;
  for (const Channel& channel : recording.channels()) {
    for (const double value : channel.values)
      if (std::isinf(value))
        throw Error({.place = recording.name() + ": " + channel.name,
                     .problem = "an infinite value cannot be written"});
    const bool is_clock = channel.name == "t_s" || channel.name == "time_s";
    bool is_new = !is_clock && names.insert(channel.name).second;
    if (!channel.fresh.empty())
      is_new = names.insert(freshness_column(channel.name)).second && is_new;
    if (!is_new)
      throw Error({.place = recording.name() + ": " + channel.name,
                   .problem = "the file would have two columns of the same name"});
  }
}

std::vector<WrittenColumn> written_columns(const Recording& recording) {
  check_columns(recording);
  WrittenColumn clock{.name = "t_s", .values = {}};
  for (std::size_t i = 0; i < recording.size(); ++i) clock.values.push_back(recording.time_s(i));
  std::vector<WrittenColumn> columns;
  columns.push_back(std::move(clock));
  for (const Channel& channel : recording.channels()) {
    columns.push_back({channel.name, channel.values});
    if (!channel.fresh.empty())
      columns.push_back(
          {freshness_column(channel.name), {channel.fresh.begin(), channel.fresh.end()}});
  }
  return columns;
}

}  // namespace torsio
