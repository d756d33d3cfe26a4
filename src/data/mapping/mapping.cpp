#include "torsio/data/mapping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "data/channel_names.hpp"
#include "data/csv/csv_table.hpp"
#include "data/mapping/columns.hpp"
#include "data/mapping/measured_recordings.hpp"
#include "data/mapping/row_order.hpp"
#include "data/marks_of_changes.hpp"
#include "data/names.hpp"
#include "data/record_clock.hpp"
#include "data/resample.hpp"
#include "data/whole_samples.hpp"
#include "torsio/core/error.hpp"
#include "torsio/core/estimate.hpp"

namespace torsio {
namespace {

constexpr std::size_t kMaxRecords = 10000;

struct NamedRows {
  std::string name;
  Rows rows;
};

std::vector<NamedRows> runs_of_equal_value(LogTable& table, const Mapping& mapping,
                                           const std::string& stem) {
  const LogColumn& column = column_named(table, mapping.split_by, mapping.file + ": split_by");
  std::vector<NamedRows> runs;
  std::map<double, std::size_t> met;
  const auto& values = column.values;
  for (std::size_t begin = 0, end = 0; begin < values.size(); begin = end) {
    if (std::isnan(values[begin]))
      throw Error({.place = table.place(begin, column),
                   .expected = "the number of the record (split_by)",
                   .found = "nothing"});
    while (end < values.size() && values[end] == values[begin]) ++end;
    const std::size_t times = ++met[values[begin]];
    const bool is_kept = mapping.keep.empty() ||
                         std::ranges::find(mapping.keep, values[begin]) != mapping.keep.end();
    if (!is_kept) continue;
    std::string name = fmt::format("{}[{}={}]", stem, column.name, values[begin]);
    if (times > 1) name += fmt::format("#{}", times);
    runs.push_back({.name = std::move(name), .rows = {.begin = begin, .end = end}});
    if (runs.size() > kMaxRecords)
      throw Error({.place = table.header_place(column),
                   .problem = fmt::format("split_by gives more than {} records", kMaxRecords)});
  }
  for (const double value : mapping.keep)
    if (!met.contains(value))
      throw Error(
          {.place = mapping.file + ": keep",
           .problem = fmt::format("{} is never {} in {}", column.name, value, table.source.file)});
  return runs;
}

std::vector<NamedRows> records_of(LogTable& table, std::size_t rows, const Mapping& mapping,
                                  const std::string& name) {
  const std::string& given = name.empty() ? table.recording_name : name;
  const std::string stem = given.empty() ? file_stem(table.source.file) : given;
  if (!mapping.split_by.empty()) return runs_of_equal_value(table, mapping, stem);
  return {{.name = stem, .rows = {.begin = 0, .end = rows}}};
}

/// What `from`, `to` and `split_at_gaps` make of the records.
std::vector<NamedRows> used_parts(const std::vector<NamedRows>& records,
                                  const TableChannels& columns, Rows used, const Mapping& mapping) {
  std::vector<NamedRows> parts;
  for (const NamedRows& record : records) {
    const Rows rows{.begin = std::max(record.rows.begin, used.begin),
                    .end = std::min(record.rows.end, used.end)};
    if (rows.begin >= rows.end) continue;
    if (!(mapping.clock.split_at_gaps_s > 0.0) || !columns.clock) {
      parts.push_back({.name = record.name, .rows = rows});
      continue;
    }
    const std::vector<Rows> between =
        parts_between_gaps(columns.clock->channel.values, rows, mapping.clock.split_at_gaps_s);
    for (std::size_t k = 0; k < between.size(); ++k)
      parts.push_back(
          {.name = between.size() == 1 ? record.name : fmt::format("{}#{}", record.name, k + 1),
           .rows = between[k]});
    if (parts.size() > kMaxRecords)
      throw Error({.place = mapping.file + ": clock.split_at_gaps",
                   .problem = fmt::format("it gives more than {} records", kMaxRecords),
                   .advice = "Give a longer time."});
  }
  if (parts.empty() && !records.empty())
    throw Error({.place = mapping.file,
                 .problem = "from:, to: and split_at_gaps: leave nothing of the log",
                 .advice = "They are seconds from the first sample of the log on."});
  return parts;
}

/// The rows of a channel; all rows are moved out, because then no other recording uses any.
Channel cut(Channel& channel, Rows rows) {
  if (rows.size() == channel.values.size()) return std::move(channel);
  const auto part = [rows](const auto& all) {
    return std::remove_cvref_t<decltype(all)>(all.begin() + static_cast<std::ptrdiff_t>(rows.begin),
                                              all.begin() + static_cast<std::ptrdiff_t>(rows.end));
  };
  Channel result{.name = channel.name, .values = part(channel.values)};
  if (!channel.fresh.empty()) result.fresh = part(channel.fresh);
  return result;
}

/// Finds the channel that a rule names.
Channel& channel_of_rule(std::vector<Channel>& channels, const std::string& name,
                         const Mapping& mapping, const std::string& key) {
  const auto at = std::ranges::find(channels, name, &Channel::name);
  if (at != channels.end()) return *at;
  const std::vector<std::string> names = channel_names(channels);
  const bool is_derived =
      std::ranges::find(mapping.derive, name, &ChannelDefinition::name) != mapping.derive.end();
  throw Error({.place = mapping.file + ": " + key,
               .problem = is_derived
                              ? "'" + name + "' is derived, and this acts on measured channels"
                              : "there is no channel '" + name + "'",
               .found = "the measured channels " + joined(names),
               .advice = is_derived ? "Name the channels that it is computed from."
                                    : did_you_mean(name, names)});
}

/// New samples are those with a value, or in a log that has one in every row, those whose value changes.
void hold(Channel& channel) {
  if (std::ranges::none_of(channel.values, [](double value) { return std::isnan(value); })) {
    channel.fresh = marks_of_changes(channel.values);
    return;
  }
  channel.fresh.resize(channel.values.size());
  double last = kNotMeasured;
  for (std::size_t i = 0; i < channel.values.size(); ++i) {
    channel.fresh[i] = std::isnan(channel.values[i]) ? 0 : 1;
    if (channel.fresh[i] != 0) last = channel.values[i];
    channel.values[i] = last;
  }
}

/// Moves the samples to the time when they were true; at the end nothing is left.
void advance(Channel& channel, std::size_t samples) {
  const auto by = static_cast<std::ptrdiff_t>(std::min(samples, channel.values.size()));
  std::shift_left(channel.values.begin(), channel.values.end(), by);
  std::fill(channel.values.end() - by, channel.values.end(), kNotMeasured);
  if (channel.fresh.empty()) return;
  std::shift_left(channel.fresh.begin(), channel.fresh.end(), by);
  std::fill(channel.fresh.end() - by, channel.fresh.end(), std::uint8_t{0});
}

double zero_of(const std::string& recording, const Channel& channel, const ZeroRule& rule,
               double sample_rate_Hz) {
  const auto& values = channel.values;
  double sum = 0.0;
  double count = 0.0;
  double lowest = HUGE_VAL;
  double highest = -HUGE_VAL;
  const double wanted =
      rule.mid_range ? HUGE_VAL : std::max(std::round(rule.first_s * sample_rate_Hz), 1.0);
  if (!rule.mid_range && wanted > static_cast<double>(values.size()))
    throw Error({.place = recording + ": zero of " + channel.name,
                 .expected = fmt::format("at most the {:g} s of the recording",
                                         static_cast<double>(values.size()) / sample_rate_Hz),
                 .found = fmt::format("the first {:g} s", rule.first_s),
                 .advice = "Give the time at rest before the motion begins, or mid_range: true."});
  for (std::size_t i = 0; i < values.size() && static_cast<double>(i) < wanted; ++i) {
    if (std::isnan(values[i])) continue;
    sum += values[i];
    count += 1.0;
    lowest = std::min(lowest, values[i]);
    highest = std::max(highest, values[i]);
  }
  if (count == 0.0)
    throw Error(
        {.place = channel.name, .problem = "nothing was measured where its zero should be taken"});
  return rule.mid_range ? 0.5 * (lowest + highest) : sum / count;
}

/// The rows from which on every held channel has a value.
Rows rows_with_held_values(const TableChannels& columns, const NamedRows& run,
                           const Mapping& mapping) {
  Rows rows = run.rows;
  for (const TableChannel& column : columns.channels) {
    const Channel& channel = column.channel;
    if (std::ranges::find(mapping.hold, channel.name) == mapping.hold.end()) continue;
    const auto begin = channel.values.begin();
    const auto end = begin + static_cast<std::ptrdiff_t>(run.rows.end);
    const auto first = std::find_if(begin + static_cast<std::ptrdiff_t>(run.rows.begin), end,
                                    [](double value) { return !std::isnan(value); });
    if (first == end)
      throw Error({.place = fmt::format("{}: hold: {}", mapping.file, channel.name),
                   .problem = "nothing was measured in " + run.name,
                   .advice = "Leave the channel out of  hold:"});
    rows.begin = std::max(rows.begin, static_cast<std::size_t>(first - begin));
  }
  return rows;
}

std::string rows_and_verb(std::size_t rows, std::string_view of_one, std::string_view of_several) {
  return rows == 1 ? fmt::format("1 row {}", of_one) : fmt::format("{} rows {}", rows, of_several);
}

/// Sorts the rows of each record that came late, and removes those that came twice. @returns how many rows remain.
std::size_t sort_rows(LogTable& table, TableChannels& columns, std::vector<NamedRows>& records,
                      std::size_t rows, const Mapping& mapping) {
  // Values of other topics are held in the order in which messages arrived.
  const auto is_held = [](const LogColumn& column) { return !column.fresh.empty(); };
  if (!columns.clock || std::ranges::any_of(table.columns, is_held)) return rows;
  std::vector<std::size_t> order;
  RowOrder found;
  std::size_t next = 0;
  const auto keep_to = [&](std::size_t end) {
    while (next < end) order.push_back(next++);
  };
  std::vector<NamedRows> sorted = records;
  for (NamedRows& record : sorted) {
    keep_to(record.rows.begin);
    const std::size_t begin = order.size();
    if (const auto of_record = find_row_order(columns, record.rows, mapping.clock.sort)) {
      order.insert(order.end(), of_record->rows.begin(), of_record->rows.end());
      next = record.rows.end;
      found.late += of_record->late;
      found.repeated += of_record->repeated;
      found.furthest = std::max(found.furthest, of_record->furthest);
    }
    keep_to(record.rows.end);
    record.rows = {.begin = begin, .end = order.size()};
  }
  keep_to(rows);
  if (found.late == 0 && found.repeated == 0) return rows;
  if (found.late > 0)
    table.notes.push_back(
        fmt::format("{} late, by up to {} rows: the rows are sorted by their time stamps",
                    rows_and_verb(found.late, "comes", "come"), found.furthest));
  if (found.repeated > 0)
    table.notes.push_back(rows_and_verb(found.repeated, "that repeats another is not read",
                                        "that repeat others are not read"));
  put_in_order(table, columns, order);
  records = std::move(sorted);
  return order.size();
}

Recording recording_of(const LogTable& table, TableChannels& columns, NamedRows run,
                       const Mapping& mapping, double rate_Hz) {
  const Rows all_rows = run.rows;
  run.rows = rows_with_held_values(columns, run, mapping);
  const std::size_t trimmed = run.rows.begin - all_rows.begin;
  const RecordClock clock = record_clock(table, columns, run.rows, mapping, rate_Hz);
  std::vector<ColumnOfChannel> named = columns_of_channels(columns, mapping);
  std::vector<Channel> channels;
  for (TableChannel& column : columns.channels) channels.push_back(cut(column.channel, all_rows));
  for (const std::string& name : mapping.hold)
    hold(channel_of_rule(channels, name, mapping, "hold"));
  if (trimmed > 0)
    for (Channel& channel : channels)
      channel = cut(channel, {.begin = trimmed, .end = all_rows.size()});
  std::size_t samples = run.rows.size();
  if (columns.clock && mapping.clock.resample_Hz > 0.0) {
    const auto stamps = spread_within_stamps(
        std::span(columns.clock->channel.values).subspan(run.rows.begin, run.rows.size()));
    samples = 1 + whole_samples((stamps.back() - stamps.front()) * clock.sample_rate_Hz + 1e-9,
                                CsvLimits{}.values / std::max<std::size_t>(channels.size(), 1),
                                mapping.file + ": clock.resample");
    for (Channel& channel : channels)
      channel = on_even_clock(channel, stamps, clock.sample_rate_Hz, samples);
  }
  for (const LatencyRule& rule : mapping.latency)
    advance(channel_of_rule(channels, rule.channel, mapping, "latency"),
            whole_samples(std::round(rule.latency_s * clock.sample_rate_Hz), samples,
                          mapping.file + ": latency." + rule.channel));
  for (const ZeroRule& rule : mapping.zero) {
    Channel& channel = channel_of_rule(channels, rule.channel, mapping, "zero");
    const double zero = zero_of(run.name, channel, rule, clock.sample_rate_Hz);
    for (double& value : channel.values) value -= zero;
  }
  Recording recording(run.name, clock.sample_rate_Hz, clock.start_s);
  recording.source = table.source;
  recording.zeros = mapping.zero;
  for (const UncertaintyRule& rule : mapping.uncertainty)
    recording.uncertainties[rule.channel] = rule.combined();
  recording.columns = std::move(named);
  recording.labels = table.labels;
  recording.notes = table.notes;
  recording.not_read = table.not_read;
  if (trimmed > 0)
    recording.notes.push_back(
        fmt::format("the first {} {} before every held channel has a value {} left out", trimmed,
                    trimmed == 1 ? "sample" : "samples", trimmed == 1 ? "is" : "are"));
  for (Channel& channel : channels) recording.add(std::move(channel));
  return recording;
}

}  // namespace

std::vector<Recording> measured_recordings(LogTable table, const Mapping& mapping, double rate_Hz,
                                           const std::string& name) {
  std::size_t rows = table.rows();  // the columns are moved out of the table
  TableChannels columns = channels_of_table(table, mapping);
  std::vector<NamedRows> records = records_of(table, rows, mapping, name);
  rows = sort_rows(table, columns, records, rows, mapping);
  std::vector<Recording> recordings;
  for (const NamedRows& run :
       used_parts(records, columns, rows_between(columns, rows, mapping, rate_Hz), mapping))
    recordings.push_back(recording_of(table, columns, run, mapping, rate_Hz));
  return recordings;
}

}  // namespace torsio
